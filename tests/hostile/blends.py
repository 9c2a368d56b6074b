# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged .blend files: each case puts a wrong value or an edit into a .blend, then uses the file as an artist would.

No step may raise an exception or print a traceback; a button may refuse in one line."""

import contextlib
import os
import re
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator, Sequence
from itertools import zip_longest
from pathlib import Path
from types import SimpleNamespace

from tests.addon.layout import Layout, context_of

from . import lies, lies_edits
from .lying_scene import Skin

LIES = lies.lies() | lies_edits.of_parts() | lies_edits.of_trees()
# The part of a lie's name that names its property.
_SUBJECT = re.compile(r"ng_\w+|natural_gratings_\w+|grating's \w+|a step")
# Texts of a fault that was caught or printed.
_FAULTS = ("Traceback", "report this line")
# The cheapest buttons that repair most.
_BUTTONS = ("assign", "mend")


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


def faults_of(addon: SimpleNamespace, blend: Path, names: Sequence[str]) -> list[str]:
    """Put wrong values and edits into a file and use the file. Return what raised or printed a traceback, each with its
    step."""
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
    faults = []
    for station, step in _stations(skin, lying).items():
        with tempfile.TemporaryFile("w+") as printed:
            try:
                with _redirected(printed):
                    step()
            except Exception:
                faults.append(f"{station}: {_last_line(traceback.format_exc())}")
            printed.seek(0)
            text = printed.read()
        if any(word in text for word in _FAULTS):
            faults.append(f"{station}: {_last_line(text)}")
    return faults


def _stations(skin: Skin, lying: Path) -> dict[str, Callable[[], object]]:
    """The steps of an artist's work with a file, by name."""
    import bpy

    handlers = skin.addon.handlers.HANDLERS
    return {
        "load": lambda: bpy.ops.wm.open_mainfile(filepath=str(lying)),
        "panel": lambda: _draw(skin),
        "edit": lambda: _edit(skin),
        "frame": lambda: skin.scene.frame_set(3),
        "render": lambda: handlers["render_init"](skin.scene),
        "undo": lambda: (handlers["undo_pre"](), handlers["undo_post"](), skin.addon.bakes.recall_bakes()),
        "bake": lambda: _asked(skin),
        **{f"press {button}": lambda button=button: _pressed(button) for button in _BUTTONS},
        "panel again": lambda: _draw(skin),
        "save": lambda: bpy.ops.wm.save_as_mainfile(filepath=str(lying), copy=True),
    }


def _pressed(name: str) -> None:
    """Press a button if it is enabled. It may refuse in one line; every other exception passes."""
    import bpy

    button = getattr(bpy.ops.grating, name)
    try:
        button.poll() and button()
    except RuntimeError as fault:
        lines = str(fault).strip().splitlines()
        if len(lines) > 1 or "Traceback" in lines[0]:
            raise


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
    context = context_of()
    for cls in skin.addon.package.CLASSES:
        if issubclass(cls, bpy.types.Panel | bpy.types.Menu):
            cls.draw(SimpleNamespace(layout=Layout()), context)
    lists = {cls.__name__: cls for cls in skin.addon.package.CLASSES if issubclass(cls, bpy.types.UIList)}
    for grating in list(scene.natural_gratings.items)[:3]:
        lists["GratingList"].draw_item(None, context, Layout(), None, grating, 0, None, "")
        for step in grating.steps:
            lists["StepList"].draw_item(None, context, Layout(), None, step, 0, None, "")
    skin.addon.levelling.refresh()


def _asked(skin: Skin) -> None:
    """Ask for a bake as the button Bake Grating does, which may refuse."""
    grating = skin.scene.natural_gratings.active()
    if grating is not None:
        with contextlib.suppress(skin.addon.child.GratingError):
            skin.addon.bakes.asked(grating.bake_request())


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
