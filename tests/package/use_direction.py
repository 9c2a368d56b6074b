# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by a Blender with a window and --enable-event-simulate: `--python use_direction.py -- BAKE PICTURES`.

Plays an artist with the sub-panel Direction, by mouse and keyboard events: shows the direction of Suzanne's grating and
of meshes without seams, unwraps Suzanne and bakes her direction map, undoing each with Ctrl-Z. The script sets the
stage, writes pictures of the window with the overlay on and off, and quits at the end."""

import importlib
import sys
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).resolve().parents[2]))

from devtools.window.hands import LONG, play, press_button, press_in_view, save_screen, show_sidebar, view, window

BAKE, PICTURES = sys.argv[sys.argv.index("--") + 1 :][:2]
ADDON = "bl_ext.user_default.natural_gratings.addon"


def set_the_stage():
    """Steps: put Suzanne with the bake's grating before the camera, and open the sub-panel."""
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
    """Steps: save the screen to a file."""
    view()[0].tag_redraw()
    yield LONG
    save_screen(Path(PICTURES) / "Xvfb_screen0", Path(PICTURES) / name)


def show_alone(name, seen_from_above):
    """Steps: hide all other meshes, and make this one active and as large as Suzanne."""
    thing = bpy.data.objects[name]
    for other in bpy.data.objects:
        if other.type == "MESH":
            other.hide_set(other != thing)
    thing.rotation_euler.x = 1.5708 if seen_from_above else 0
    thing.scale = [2 / max(thing.dimensions)] * 3
    bpy.context.view_layer.objects.active = thing
    yield LONG


def show_without_seams():
    """Steps: take pictures of meshes without seams, with the overlay on and off."""
    with bpy.context.temp_override(window=window(), area=view()[0], region=view()[1]):
        bpy.ops.mesh.primitive_grid_add(x_subdivisions=20, y_subdivisions=20)
        bpy.ops.mesh.primitive_monkey_add()
        bpy.context.object.name = "Combed"
        bpy.ops.grating.comb("EXEC_DEFAULT", source="SMOOTHEST")
        bpy.ops.grating.add_snake("EXEC_DEFAULT", pose="COILED", faces=20_000)
        bpy.context.object.name = "Snake"
    for name in ("Grid", "Combed", "Snake"):
        yield from show_alone(name, seen_from_above=name != "Combed")
        for state in ("on", "off"):
            bpy.ops.grating.show_direction()
            yield from take_picture(f"{name.lower()}_{state}.png")


def spoil_the_overlay():
    """Steps: a drawing error switches the overlay off, and the button reports it."""
    overlay = importlib.import_module(f"{ADDON}.workflow.directing")
    button = importlib.import_module(f"{ADDON}.operators.direction").ShowDirection
    sound = overlay.direction_lines
    overlay.direction_lines = lambda *_: 1 / 0
    bpy.ops.grating.show_direction()
    view()[0].tag_redraw()
    yield from waited_for(lambda: not button.on)
    assert not overlay.is_shown()
    yield from take_picture("fault.png")
    assert "switched off: drawing failed (ZeroDivisionError: division by zero)" in button.fault
    overlay.direction_lines = sound


def maps():
    return [layer.name for layer in bpy.data.objects["Suzanne"].data.uv_layers]


def waited_for(what):
    """Steps: wait until a condition holds."""
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
    yield from show_without_seams()
    yield from spoil_the_overlay()
    for name in ("Grid", "Combed", "Snake"):
        bpy.data.objects.remove(bpy.data.objects[name])
    yield from show_alone("Suzanne", seen_from_above=False)
    bpy.data.objects["Suzanne"].select_set(True)

    unwrap = importlib.import_module(f"{ADDON}.operators.direction").Unwrap
    packages = importlib.import_module(f"{ADDON.rpartition('.')[0]}.precompute.base.machine")
    yield from press_button("bpy.ops.grating.unwrap")
    yield from waited_for(lambda: maps() == ["UVMap", "Unwrapped"])
    yield from press_in_view("Z", ctrl=True)
    assert maps() == ["UVMap"], f"Ctrl-Z after Unwrap: {maps()}"
    yield from press_in_view("Z", ctrl=True, shift=True)
    assert maps() == ["UVMap", "Unwrapped"]
    yield from press_button("bpy.ops.grating.bake_direction_map")
    yield from waited_for(lambda: bpy.context.scene.natural_gratings.items[0].frame_kind == "FRAME_MAP")
    assert [scene.name for scene in bpy.data.scenes] == ["Scene"] and window().scene.name == "Scene"
    yield from press_in_view("Z", ctrl=True)
    assert bpy.context.scene.natural_gratings.items[0].frame_kind != "FRAME_MAP"
    yield from take_picture("end.png")
    if "xatlas" in packages.missing_packages():
        # In the view's own context, as from an artist's shortcut: the process ends with one line.
        with bpy.context.temp_override(window=window(), area=view()[0], region=view()[1]):
            assert bpy.ops.grating.unwrap("INVOKE_DEFAULT") == {"RUNNING_MODAL"}
        yield from waited_for(lambda: unwrap.job is None)
        assert maps() == ["UVMap", "Unwrapped"]


play(story())
