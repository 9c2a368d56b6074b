# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged .blend files: each case puts a wrong value or an edit into a .blend, then uses the file as an artist would.

No step may raise an exception or print a traceback; a button may refuse in one line. The cases run in child processes
with Blender, many cases in each. If Blender crashes, only the case at hand is lost."""

import contextlib
import json
import os
import re
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from itertools import zip_longest
from pathlib import Path
from types import SimpleNamespace

from ..handlers import Layout, context_of
from . import lies, lies_edits
from .lying_scene import Skin
from .runner import ACCEPTED, FAILED, REFUSED, Outcome

LIES = lies.lies() | lies_edits.of_parts() | lies_edits.of_trees()
# The part of a lie's name that names its property.
_SUBJECT = re.compile(r"ng_\w+|grating's \w+|a step")
# Texts of a fault that was caught or printed.
_FAULTS = ("Traceback", "report this line")
# The buttons to press, in this order, with their options. "needs" measures the scene's needs but does not bake. Fit
# World is left out because it starts its own Blender.
_BUTTONS: dict[str, dict[str, object]] = {
    "needs": {},
    "assign": {},
    "adopt": {},
    "mend": {},
    "vary": {"turn": 0.2},
    "lights": {"lights": "LAMPS"},
    "add_diffraction_lamp": {},
    "direction": {"kind": "AXIS"},
    "unwrap": {"size": 16, "method": "MINIMUM_STRETCH"},
    "comb": {"source": "X"},
    "add_diffraction": {},
    "remove_diffraction": {},
}
# Seconds to wait for Blender, besides 5 seconds a case.
_PATIENCE = 300


def outcomes(only: str, folder: Path) -> list[Outcome]:
    """Run the cases whose names begin with `only`, and return their outcomes."""
    left, found = [name for name in LIES if name.startswith(only)], []
    while left:
        told = list(_told_by_blender(left, folder))
        found += told
        left = left[len(told) :]
        if left and len(told) < len(left) + len(told):  # Blender crashed or was stopped
            found.append(Outcome(left.pop(0), "blends", FAILED, "Blender ended, or hung", 0.0, 0))
    return found


def _told_by_blender(names: Sequence[str], folder: Path) -> Iterator[Outcome]:
    """Yield the outcomes of the first cases, as far as one Blender process gets."""
    with tempfile.TemporaryDirectory(dir=folder) as own, (Path(own) / "printed").open("wb") as printed:
        command = [sys.executable, "-m", "laboratory.benchmarks.hostile.blends", own, json.dumps(list(names))]
        with contextlib.suppress(subprocess.TimeoutExpired):
            subprocess.run(command, stdout=printed, stderr=printed, timeout=_PATIENCE + 5 * len(names), check=False)
        path = Path(own) / "outcomes"
        for line in path.read_text().splitlines() if path.exists() else ():
            yield Outcome(**json.loads(line))


def main(argv: Sequence[str]) -> None:
    """Run cases in this Blender process and write the outcome of each as a line of JSON."""
    from precompute.bake.make import bake_to_folder
    from precompute.bake.request import BakeRequest
    from precompute.surface.readers.reader_registry import read_height_map

    from ..osl import start_blender
    from .lying_scene import build, write_scan

    folder, names = Path(argv[0]), json.loads(argv[1])
    os.environ["NATURAL_GRATINGS_CACHE"] = str(folder / "cache")
    addon = start_blender(folder)
    (folder / "file").mkdir()
    scan = write_scan(folder / "file" / "waves.png")
    surface = read_height_map(str(scan), 4.0, 100.0)
    bake = bake_to_folder([surface], BakeRequest(), folder)
    blend = build(addon, scan, Path(bake["files"][0]))
    with (folder / "outcomes").open("w") as written:
        for name in names:
            written.write(json.dumps(asdict(outcome(addon, blend, name, render=True))) + "\n")
            written.flush()
    os._exit(0)  # Blender 4.5 may hang at exit


def outcome(addon: SimpleNamespace, blend: Path, name: str, *, render: bool) -> Outcome:
    """Put one wrong value or edit into a file and use the file."""
    _forget_peak()
    before, start = _memory("VmRSS"), time.process_time()
    faults, refusals = told(addon, blend, [name], buttons=tuple(_BUTTONS), render=render)
    seconds, peak = time.process_time() - start, max(0, _memory("VmHWM") - before)
    verdict = FAILED if faults else REFUSED if refusals else ACCEPTED
    return Outcome(name, "blends", verdict, "; ".join(faults or refusals), seconds, peak)


def rounds() -> list[list[str]]:
    """The cases in as few files as possible. A file holds one case of each property; each edit of node groups runs on
    two of the groups; every other case has its own file."""
    by_subject: dict[str, list[str]] = {}
    for name in lies.lies():
        by_subject.setdefault(_SUBJECT.match(name)[0], []).append(name)
    together = [[name for name in row if name] for row in zip_longest(*by_subject.values())]
    trees, edits = lies_edits.TREES, list(lies_edits.of_trees())
    some = [each for n, each in enumerate(edits) if n % trees in (0, 1 + n // trees % (trees - 1))]
    return together + [[name] for name in (*lies_edits.of_parts(), *some)]


def told(
    addon: SimpleNamespace, blend: Path, names: Sequence[str], *, buttons: Sequence[str], render: bool
) -> tuple[list[str], list[str]]:
    """Put wrong values and edits into a file and use the file. Return what raised or printed a traceback, and the lines
    by which buttons refused, each with its step."""
    import bpy

    skin = Skin(addon)
    lying = blend.with_name("lying.blend")
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    if hasattr(addon, "guard"):
        addon.guard._printed.clear()
    with _without_handlers(addon):  # handlers would repair the file before it is saved
        for name in names:
            LIES[name](skin)
        bpy.ops.wm.save_as_mainfile(filepath=str(lying), copy=True)
    faults, refusals = [], []
    for station, step in _stations(skin, lying, buttons=buttons, render=render).items():
        with tempfile.TemporaryFile("w+") as printed:
            try:
                with _redirected(printed):
                    line = step()
                if line:
                    refusals.append(f"{station}: {line}")
            except Exception:
                faults.append(f"{station}: {_last_line(traceback.format_exc())}")
            printed.seek(0)
            text = printed.read()
        if any(word in text for word in _FAULTS):
            faults.append(f"{station}: {_last_line(text)}")
    return faults, refusals


def _stations(skin: Skin, lying: Path, *, buttons: Sequence[str], render: bool) -> dict[str, Callable[[], str | None]]:
    """The steps of an artist's work with a file, by name."""
    import bpy

    handlers = skin.addon.handlers.HANDLERS
    steps: dict[str, Callable[[], object]] = {
        "load": lambda: bpy.ops.wm.open_mainfile(filepath=str(lying)),
        "panel": lambda: _draw(skin),
        "edit": lambda: _edit(skin),
        "frame": lambda: skin.scene.frame_set(3),
        "render": lambda: _operated(bpy.ops.render.render) if render else handlers["render_init"](skin.scene),
        "undo": lambda: (handlers["undo_pre"](), handlers["undo_post"](), skin.addon.bakes.recall_bakes()),
        "bake": lambda: _asked(skin),
    }
    for button in buttons:
        steps[f"press {button}"] = lambda button=button: _needed(skin) if button == "needs" else _pressed(button)
    steps["panel again"] = lambda: _draw(skin)
    steps["save"] = lambda: bpy.ops.wm.save_as_mainfile(filepath=str(lying), copy=True)
    return {name: lambda step=step: _refusal(step) for name, step in steps.items()}


def _refusal(step: Callable[[], object]) -> str | None:
    """Do a step and return its one-line refusal, if any. Passes on exceptions."""
    from_addon = step()
    return from_addon if isinstance(from_addon, str) else None


def _pressed(name: str) -> str | None:
    """Press a button if it is enabled; return its one-line refusal, if any."""
    import bpy

    button = getattr(bpy.ops.grating, name)
    return _operated(button, **_BUTTONS[name]) if button.poll() else None


def _operated(operator: Callable[..., object], **options: object) -> str | None:
    """Run an operator; return the one-line error of a refusal. Passes on every other exception."""
    try:
        operator(**options)
    except RuntimeError as fault:
        lines = str(fault).strip().splitlines()
        if len(lines) > 1 or "Traceback" in lines[0]:
            raise
        return lines[0]
    return None


def _edit(skin: Skin) -> None:
    """Turn all lamps, change their strengths and hide one."""
    import bpy

    for number, lamp in enumerate(each for each in skin.scene.objects if each.type == "LIGHT"):
        lamp.rotation_euler[0] += 0.1
        lamp.data.energy = 2.0 + number
        lamp.hide_render = number == 1
    bpy.context.view_layer.update()


def _draw(skin: Skin) -> None:
    """Draw all panels and menus, and up to three rows of the grating list with their steps."""
    import bpy

    scene = skin.scene
    context = context_of(scene)
    context.active_object = bpy.context.view_layer.objects.active
    for cls in skin.addon.package.CLASSES:
        if issubclass(cls, bpy.types.Panel | bpy.types.Menu):
            cls.draw(SimpleNamespace(layout=Layout()), context)
    lists = {cls.__name__: cls for cls in skin.addon.package.CLASSES if issubclass(cls, bpy.types.UIList)}
    for grating in list(scene.natural_gratings.items)[:3]:
        lists["GratingList"].draw_item(None, context, Layout(), None, grating, 0, None, "")
        for step in grating.steps:
            lists["StepList"].draw_item(None, context, Layout(), None, step, 0, None, "")
    skin.addon.previewing_levelling.refresh()


def _asked(skin: Skin) -> str | None:
    """Ask for a bake as the button Bake Grating does; return the error text, if any."""
    grating = skin.scene.natural_gratings.active()
    if grating is None:
        return None
    try:
        skin.addon.bakes.asked(grating.bake_request())
    except skin.addon.child.GratingError as fault:
        return str(fault)
    return None


def _needed(skin: Skin) -> str | None:
    """Measure the needs as the button Bake for This Scene does; return the error text, if any."""
    grating = skin.scene.natural_gratings.active()
    if grating is None:
        return None
    try:
        skin.addon.measuring_needs.measure_needs(skin.scene, grating)
    except skin.addon.child.GratingError as fault:
        return str(fault)
    return None


@contextlib.contextmanager
def _without_handlers(addon: SimpleNamespace) -> Iterator[None]:
    addon.handlers.unregister()
    try:
        yield
    finally:
        addon.handlers.register()


@contextlib.contextmanager
def _redirected(file) -> Iterator[None]:
    """Send the standard streams of Python and of C into a file."""
    kept = [os.dup(stream) for stream in (1, 2)]
    sys.stdout.flush()
    sys.stderr.flush()
    try:
        with contextlib.redirect_stdout(file), contextlib.redirect_stderr(file):
            for stream in (1, 2):
                os.dup2(file.fileno(), stream)
            yield
            file.flush()
    finally:
        for stream, former in zip((1, 2), kept, strict=True):
            os.dup2(former, stream)
            os.close(former)


def _last_line(text: str) -> str:
    """The line of a printed fault that names the fault and its place."""
    lines = [line.strip() for line in text.strip().splitlines() if line.strip()]
    noted = [line for line in lines if "report this line" in line]
    places = [line.split("/")[-1] for line in lines if line.startswith("File ")]
    return noted[-1] if noted else f"{lines[-1][:300]} ({' < '.join(places[:-4:-1])})"


def _forget_peak() -> None:
    Path("/proc/self/clear_refs").write_text("5")


def _memory(what: str) -> int:
    """Bytes from a line of /proc/self/status."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(what))


if __name__ == "__main__":
    main(sys.argv[1:])
