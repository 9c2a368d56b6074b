# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by a Blender with a window and --enable-event-simulate: `--python drop_scan.py -- SCAN SCREEN PICTURE`.

Drops SCAN on the 3D view by calling Blender's own operator for a dropped file. The preview must appear by itself. Then
a step is added, the scan is baked with the panel's button, and everything is undone and redone by keyboard. Errors are
in the exit status and the output. PICTURE is a copy of the screen (the file SCREEN) once the scan is levelled.
"""

import importlib
import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).resolve().parents[2]))

from devtools.window.hands import LONG, play, press_button, press_in_view, save_screen, show_sidebar, view, window

SCAN, SCREEN, PICTURE = (Path(each) for each in sys.argv[sys.argv.index("--") + 1 :])
ADDON = "bl_ext.user_default.natural_gratings.addon"
# The most looks, half a second each, that wait for a preview.
_LOOKS = 40


def active():
    """The active grating, looked up again because undo frees Python's references."""
    return bpy.context.scene.natural_gratings.active()


def previewed():
    """Steps: wait until the panel, by being redrawn, has made its preview; returns the preview."""
    shown = importlib.import_module(f"{ADDON}.workflow.levelling").shown
    for _ in range(_LOOKS):
        view()[0].tag_redraw()
        yield LONG / 2
        found = shown(active())
        if found is not None:
            assert found.preview is not None, found.failure
            assert all(found.icons) and len(set(found.icons)) == 2, found.icons
            return found.preview
    raise AssertionError("no preview appears")


def drop():
    """Call what Blender calls for a dropped file."""
    with bpy.context.temp_override(window=window(), area=view()[0], region=view()[1]):
        bpy.ops.wm.drop_import_file("INVOKE_DEFAULT", True, directory=f"{SCAN.parent}/", files=[{"name": SCAN.name}])


def baked():
    """Steps: wait for the bake in its child process."""
    operator = importlib.import_module(f"{ADDON}.operators.bake").BakeGrating
    while operator.job is not None:
        yield LONG / 2
    yield LONG


def story():
    """The steps; each yields the seconds until the next."""
    yield LONG
    yield from press_in_view("ESC")  # closes the splash screen
    yield from show_sidebar()
    drop()
    yield LONG
    assert active() is not None and active().source == str(SCAN), "the drop imported nothing"
    first = yield from previewed()
    assert first.before.range_m > first.after.range_m
    with bpy.context.temp_override(window=window(), area=view()[0], region=view()[1]):
        bpy.ops.grating.add_step("EXEC_DEFAULT", True, kind="dust")
    levelled = yield from previewed()
    assert any("dust:5" in line for line in levelled.told), levelled.told
    save_screen(SCREEN, PICTURE)
    active().delta_e = 6
    bpy.ops.ed.undo_push(message="colour error")
    yield from press_button("bpy.ops.grating.bake")
    yield from baked()
    path = active().bake_path
    assert path, "nothing was baked"
    for _ in range(3):  # the bake, the colour error, the step
        yield from press_in_view("Z", ctrl=True)
    assert active().levelling == "plane" and not active().bake_path, active().levelling
    yield from press_in_view("Z", ctrl=True)
    assert active() is None, "undo left the import"
    for _ in range(4):
        yield from press_in_view("Z", ctrl=True, shift=True)
    assert active().levelling == "plane,dust:5" and active().bake_path == path


play(story())
