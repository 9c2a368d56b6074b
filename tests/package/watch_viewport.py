# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by a Blender with a window: `--python watch_viewport.py -- BAKE FOLDER`, on make_plane.py's file.

Assigns the bake, shows the camera's view in Rendered mode, and changes, hides, deletes and adds lamps as an artist
does, with undo and redo, but without pressing a button. After each change it writes the viewport's picture to FOLDER as
STEP_view.png, and after some changes a render as STEP_render.png. It quits at the end.
"""

import sys
from math import radians
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).resolve().parents[2]))

from devtools.window.hands import play
from tests.clean_scene import dark_world

BAKE, FOLDER = map(Path, sys.argv[sys.argv.index("--") + 1 :])
# Seconds for the window to draw.
PAUSE = 2.0


def assign():
    scene = bpy.context.scene
    grating = scene.natural_gratings.items.add()
    grating.name, grating.bake_path = "baked", str(BAKE)
    scene.natural_gratings.active_index = 0
    plane = bpy.data.objects["Plane"]
    bpy.context.view_layer.objects.active = plane
    plane.select_set(True)
    assert bpy.ops.grating.assign() == {"FINISHED"}


def set_view():
    """Set Rendered mode through the camera without overlays, and let renders match the viewport."""
    scene = bpy.context.scene
    scene.render.engine = "BLENDER_EEVEE_NEXT" if bpy.app.version < (5, 0) else "BLENDER_EEVEE"
    scene.eevee.taa_samples = scene.eevee.taa_render_samples = 4
    scene.eevee.use_shadows = False  # nothing casts one; a shadow map costs half a second a sample
    scene.world = dark_world()
    scene.render.resolution_x = scene.render.resolution_y = 160
    scene.view_settings.view_transform = "Standard"
    scene.render.image_settings.file_format = "PNG"
    area = next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D")
    space = area.spaces.active
    space.shading.type = "RENDERED"
    space.overlay.show_overlays = False
    space.region_3d.view_perspective = "CAMERA"
    return area


def turn(lamp):
    lamp.rotation_euler = (radians(15), radians(-20), 0)


def colour(lamp):
    lamp.data.color, lamp.data.energy = (1.0, 0.2, 0.1), 2.0


def animate(lamp):
    lamp.keyframe_insert("rotation_euler", frame=1)
    lamp.rotation_euler = (0, radians(40), 0)
    lamp.keyframe_insert("rotation_euler", frame=10)
    bpy.context.scene.frame_set(10)


def hide(lamp):
    lamp.hide_set(True)


def show(lamp):
    lamp.hide_set(False)


def make_area(lamp):
    lamp.location, lamp.rotation_euler = (0.2, 0, 1.0), (0, 0, 0)
    lamp.animation_data_clear()
    lamp.data.type, lamp.data.energy, lamp.data.size = "AREA", 30.0, 0.05


def exclude(lamp):
    scene = bpy.context.scene
    held = bpy.data.collections.new("Held")
    scene.collection.children.link(held)
    for collection in lamp.users_collection:
        collection.objects.unlink(lamp)
    held.objects.link(lamp)
    bpy.context.view_layer.layer_collection.children["Held"].exclude = True


def include(lamp):
    bpy.context.view_layer.layer_collection.children["Held"].exclude = False


def delete(lamp):
    bpy.data.objects.remove(lamp)


def add_two(lamp):
    for name, turn in (("One", 20), ("Two", -35)):
        made = bpy.data.objects.new(name, bpy.data.lights.new(name, "SUN"))
        made.rotation_euler.y = radians(turn)
        made.data.energy = 2.0
        bpy.context.scene.collection.objects.link(made)


def undo(lamp):
    bpy.ops.ed.undo()


def redo(lamp):
    bpy.ops.ed.redo()


STEPS = {
    "assigned": None,
    "turned": turn,
    "coloured": colour,
    "animated": animate,
    "eye closed": hide,
    "eye opened": show,
    "area": make_area,
    "excluded": exclude,
    "included": include,
    "deleted": delete,
    "deleted, undone": undo,
    "two more": add_two,
    "two more, undone": undo,
    "two more again": redo,
}
# Steps that also write a render; a picture takes some seconds on a software rasteriser.
RENDERED = {"assigned", "turned", "coloured", "animated", "eye closed", "area", "excluded", "two more again"}


def story():
    """The steps; each yields the seconds until the next."""
    yield PAUSE
    assign()
    area = set_view()
    for name, change in STEPS.items():
        if change:
            with bpy.context.temp_override(window=bpy.context.window_manager.windows[0]):
                change(bpy.data.objects.get("Sun"))
                if change not in (undo, redo):
                    bpy.ops.ed.undo_push(message=name)
        yield PAUSE
        scene = bpy.context.scene
        region = next(r for r in area.regions if r.type == "WINDOW")
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=area, region=region):
            scene.render.filepath = str(FOLDER / f"{name}_view.png")
            bpy.ops.render.opengl(write_still=True, view_context=True)
        if name in RENDERED:
            scene.render.filepath = str(FOLDER / f"{name}_render.png")
            bpy.ops.render.render(write_still=True)


play(story())
