# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by a Blender with a window and --enable-event-simulate: `--python use_direction.py -- BAKE PICTURES`.

An artist with the sub-panel Direction: shows the direction of Suzanne's grating, unwraps her and bakes her frame map,
each undone with Ctrl-Z; by mouse and keyboard events. The script sets the stage and writes pictures of the window with
the overlay on and off. It quits at the end; what went wrong is in the exit status and the output."""

import importlib
import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).resolve().parents[2]))

from devtools.hands import LONG, play, press_button, press_in_view, screen_picture, show_sidebar, view, window

BAKE, PICTURES = sys.argv[sys.argv.index("--") + 1 :][:2]
ADDON = "bl_ext.user_default.natural_gratings.addon"


def set_the_stage():
    """Steps: Suzanne with the bake's grating before the camera, and the sub-panel open."""
    bpy.data.batch_remove(list(bpy.data.objects))
    bpy.ops.mesh.primitive_monkey_add()
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0, -4, 0)
    camera.rotation_euler = (1.5708, 0, 0)
    bpy.context.scene.collection.objects.link(camera)
    bpy.context.scene.camera = camera
    grating = bpy.context.scene.natural_gratings.items.add()
    grating.name, grating.bake_path = "blazed", BAKE
    panel = importlib.import_module(f"{ADDON}.ui.direction_panel").DirectionPanel
    bpy.utils.unregister_class(panel)
    panel.bl_options = set()
    bpy.utils.register_class(panel)
    yield from show_sidebar()
    with bpy.context.temp_override(window=window()):
        assert bpy.ops.grating.assign("EXEC_DEFAULT", True) == {"FINISHED"}
    yield LONG


def take_picture(name):
    """Steps: the screen in a file."""
    view()[0].tag_redraw()
    yield LONG
    screen_picture(Path(PICTURES) / "Xvfb_screen0").save(Path(PICTURES) / name)


def maps():
    return [layer.name for layer in bpy.data.objects["Suzanne"].data.uv_layers]


def waited_for(what):
    """Steps: until something is so."""
    for _ in range(60):
        if what():
            return
        yield LONG
    raise AssertionError("waited in vain")


def story():
    """The steps; each yields the seconds until the next."""
    yield LONG
    yield from set_the_stage()
    yield from take_picture("off.png")
    yield from press_button("bpy.ops.grating.show_direction")
    yield from take_picture("on.png")
    yield from press_button("bpy.ops.grating.show_direction")
    yield from take_picture("off_again.png")

    unwrap = importlib.import_module(f"{ADDON}.operators.unwrap").Unwrap
    has_xatlas = importlib.import_module(f"{ADDON.rpartition('.')[0]}.precompute.mesh.unwrap").has_xatlas()
    yield from press_button("bpy.ops.grating.unwrap")
    yield from waited_for(lambda: maps() == ["UVMap", "Unwrapped"])
    yield from press_in_view("Z", ctrl=True)
    assert maps() == ["UVMap"], f"Ctrl-Z after Unwrap: {maps()}"
    yield from press_in_view("Z", ctrl=True, shift=True)
    assert maps() == ["UVMap", "Unwrapped"]
    yield from press_button("bpy.ops.grating.bake_frame_map")
    yield from waited_for(lambda: bpy.context.scene.natural_gratings.items[0].frame_kind == "FRAME_MAP")
    assert [scene.name for scene in bpy.data.scenes] == ["Scene"] and window().scene.name == "Scene"
    yield from press_in_view("Z", ctrl=True)
    assert bpy.context.scene.natural_gratings.items[0].frame_kind != "FRAME_MAP"
    yield from take_picture("end.png")
    if not has_xatlas:
        # In the view's own context, as a key that an artist gave it: the process ends with one line.
        with bpy.context.temp_override(window=window(), area=view()[0], region=view()[1]):
            assert bpy.ops.grating.unwrap("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
        yield from waited_for(lambda: unwrap.running is None)
        assert maps() == ["UVMap", "Unwrapped"]


play(story())
