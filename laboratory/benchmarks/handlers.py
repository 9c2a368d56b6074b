# SPDX-License-Identifier: GPL-3.0-or-later
"""Milliseconds that the add-on spends on editing a lamp and redrawing its panel, in scenes that are large in one way.

    ./dev bench handlers [--scene NAME] [--repeat 15] [--json FILE|-]

The benchmark repeatedly moves a lamp and sets its strength. After each edit Blender evaluates the scene and calls the
add-on's handlers, as with a window open. Then the panel is drawn into a stand-in for Blender's layout. The table gives
the median time of the handlers alone, of the panel alone, and of the timers that run once nothing has changed for 0.2
seconds. Blender's own time for evaluating and drawing is excluded.
"""

import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

from precompute.bake.make import bake_to_folder
from precompute.bake.request import BakeRequest
from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser
from precompute.surface.readers.reader_registry import read_height_map

from . import report
from .handlers_scenes import SCENES, plain
from .osl import start_blender

# Bakes in a moment, at an error for which the bake has a sample set.
_SURFACE, _DELTA_E = "sample:blazed", 10.0
_COLUMNS = ("lamp moved", "lamp's strength", "panel's redraw", "once still")


class Layout:
    """A stand-in for Blender's layout: accepts every call and draws nothing."""

    def __getattr__(self, name: str) -> Callable[..., "Layout"]:
        return lambda *_, **__: self

    def panel(self, *_: object, **__: object) -> tuple["Layout", "Layout"]:
        """The header and the body of an open sub-panel."""
        return self, self

    def panel_prop(self, data: object, name: str) -> tuple["Layout", "Layout"]:
        """The header and the body of a sub-panel whose property tells whether it is open; drawn as open."""
        getattr(data, name)
        return self, self


def main(argv: list[str] | None = None) -> int:
    """Print the table and return the exit status."""
    parser = OneLineParser(prog="./dev bench handlers", description=__doc__.splitlines()[0])
    parser.add_argument("--scene", action="append", choices=SCENES, help="default: all of them")
    parser.add_argument("--repeat", type=count(3, 1000), default=15, metavar="N", help="edits; default 15")
    report.add_json(parser)
    arguments = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as folder:
        addon = start_blender(Path(folder))
        request = BakeRequest(delta_e=_DELTA_E)
        bake = bake_to_folder([read_height_map(_SURFACE)], request, Path(folder))
        rows = []
        report.say(f"{'ms':34}" + "".join(f"{column:>17}" for column in _COLUMNS), arguments.json)
        for name in arguments.scene or SCENES:
            plain(addon, Path(bake["files"][0]))
            SCENES[name](addon)
            rows.append({"scene": name} | measured(addon, arguments.repeat))
            told = "".join(f"{rows[-1][column]:17.2f}" for column in _COLUMNS)
            report.say(f"{name:34}{told}", arguments.json)
    report.write({"blender": _version(), "rows": rows}, arguments.json)
    return 0


def measured(addon: SimpleNamespace, repeat: int) -> dict[str, float]:
    """The median milliseconds of the handlers after each kind of edit, of the panel's redraw and of the timers."""
    import bpy

    scene = bpy.context.scene
    lamp = scene.objects["Sun"]
    context = context_of(scene)
    spent: dict[str, list[float]] = {column: [] for column in _COLUMNS}
    handlers = bpy.app.handlers.depsgraph_update_post
    own = [handler for handler in handlers if handler.__module__.startswith(addon.package.__name__)]
    taken = []

    def timed(*update: object) -> None:
        start = time.perf_counter()
        for handler in own:
            handler(*update)
        taken.append(time.perf_counter() - start)

    def edited(edit: Callable[[], None]) -> float:
        taken.clear()
        edit()
        bpy.context.view_layer.update()
        return sum(taken)

    with_window(addon)
    for handler in own:
        handlers.remove(handler)
    handlers.append(timed)
    try:
        for number in range(repeat + 2):
            for column, edit in zip(_COLUMNS, _edits(lamp, number), strict=False):
                spent[column].append(edited(edit))
                start = time.perf_counter()
                addon.panel.GratingPanel.draw(SimpleNamespace(layout=Layout()), context)
                spent["panel's redraw"].append(time.perf_counter() - start)
            time.sleep(addon.compat.STILL)
            start = time.perf_counter()
            addon.handlers._follow_when_still()
            addon.facts._find_again()
            spent["once still"].append(time.perf_counter() - start)
    finally:
        handlers.remove(timed)
        for handler in own:
            handlers.append(handler)
    # The first edits include the work on the new scene itself.
    return {column: 1e3 * statistics.median(times[2:]) for column, times in spent.items()}


def _edits(lamp, number: int) -> tuple[Callable[[], None], ...]:
    """The edits of a round: each gives the lamp a new direction or a new strength."""
    return (
        lambda: setattr(lamp, "rotation_euler", (0.1 + 0.01 * number, 0.2, 0.3)),
        lambda: setattr(lamp.data, "energy", 1.0 + 0.01 * number),
    )


def with_window(addon: SimpleNamespace) -> None:
    """Let the handlers and the panel behave as with a window open."""
    addon.handlers.has_window = addon.facts.has_window = lambda: True


def context_of(scene) -> SimpleNamespace:
    """A stand-in for the parts of Blender's context that the panel reads."""
    import bpy

    preferences = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))  # the scale is 0 in background mode
    return SimpleNamespace(
        scene=scene, region=SimpleNamespace(width=300), preferences=preferences, active_object=None,
        window_manager=bpy.context.window_manager, selected_objects=list(bpy.context.view_layer.objects.selected),
        space_data=None, view_layer=bpy.context.view_layer,
        evaluated_depsgraph_get=bpy.context.evaluated_depsgraph_get,
    )  # fmt: skip


def _version() -> str:
    import bpy

    return bpy.app.version_string
