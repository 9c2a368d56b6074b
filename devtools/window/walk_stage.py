# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the file for the walk: `--python walk_stage.py -- FOLDER`, in a Blender in background.

stage.blend has a sun and a row of objects, each a case that artists' files contain. guest.blend holds an object that
stage.blend links. waves.txt is a scan that does not store its size; it is a text, because Blender's Python may lack
Pillow. logo.png is the picture of a sticker."""

import sys
from math import radians, sin
from pathlib import Path

import bpy

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])


def material(name: str, colour: tuple[float, float, float]) -> bpy.types.Material:
    """A material of a colour."""
    made = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0, 0):
        made.use_nodes = True
    base = next(node for node in made.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    base.inputs["Base Color"].default_value = (*colour, 1)
    return made


def placed(name: str, x: float, y: float, *materials: bpy.types.Material) -> bpy.types.Object:
    """The object that an operator has just added, moved to its place in the row."""
    thing = bpy.context.object
    thing.name, thing.location = name, (x, y, 0)
    for each in materials:
        thing.data.materials.append(each)
    return thing


def ball(name: str, x: float, y: float, *materials: bpy.types.Material) -> bpy.types.Object:
    """A smooth ball."""
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.8)
    bpy.ops.object.shade_smooth()
    return placed(name, x, y, *materials)


def save(name: str) -> None:
    """Save the open file into the folder."""
    bpy.ops.object.select_all(action="DESELECT")
    bpy.ops.wm.save_as_mainfile(filepath=str(FOLDER / name))


bpy.ops.wm.read_homefile(use_empty=True)
row = " ".join(f"{0.5 + 0.5 * sin(0.8 * x):.4f}" for x in range(64))
(FOLDER / "waves.txt").write_text(f"{row}\n" * 64)
logo = bpy.data.images.new("logo", 64, 64)
logo.pixels = [value for y in range(64) for x in range(64) for value in (x / 64, y / 64, 1 - x / 64, 1)]
logo.filepath_raw, logo.file_format = str(FOLDER / "logo.png"), "PNG"
logo.save()
ball("Guest", 1, -1.2, material("Guest Paint", (0.1, 0.3, 0.1)))
save("guest.blend")

bpy.ops.wm.read_homefile(use_empty=True)
shared = material("Shared Paint", (0.02, 0.08, 0.3))
ball("Left", -4, 1, shared)
ball("Right", -2, 1, shared)
bpy.ops.mesh.primitive_cube_add(size=1.4)
three = placed("Three", 0, 1, *(material(*each) for each in (
    ("Skin", (0.3, 0.05, 0.03)), ("Belly", (0.3, 0.25, 0.1)), ("Eye", (0.02, 0.02, 0.02)))))  # fmt: skip
three.rotation_euler = (radians(-20), radians(15), 0)
for polygon, slot in zip(three.data.polygons, (0, 1, 2, 0, 1, 2), strict=True):
    polygon.material_index = slot
bpy.ops.mesh.primitive_monkey_add(size=1.6, rotation=(radians(-60), 0, 0))
placed("Suzanne", 2, 1)
bpy.ops.curve.primitive_bezier_circle_add(radius=0.7)
placed("Curve", 4, 1).data.bevel_depth = 0.15
broken = material("Broken Paint", (0.3, 0.3, 0.3))
broken.node_tree.nodes.remove(next(node for node in broken.node_tree.nodes if node.type == "OUTPUT_MATERIAL"))
ball("Broken", -2, -1.2, broken)
with bpy.data.libraries.load(str(FOLDER / "guest.blend"), link=True) as (_, into):
    into.objects = ["Guest"]
bpy.context.scene.collection.objects.link(into.objects[0])

bpy.ops.object.light_add(type="SUN", rotation=(radians(25), radians(20), 0))
bpy.context.object.name = "Sun"
bpy.context.object.data.energy = 6
bpy.context.object.data.angle = radians(4)
bpy.ops.object.camera_add(location=(0.9, 0, 16))
scene = bpy.context.scene
scene.camera = bpy.context.object
scene.camera.data.angle = radians(42)
scene.world = bpy.data.worlds.new("World")
scene.render.engine = "CYCLES"
scene.cycles.preview_samples = 2
scene.render.preview_pixel_size = "4"  # on two processors each station waits for the viewport
scene.cycles.use_preview_denoising = False
save("stage.blend")
# Without saved preferences, Blender opens with its Quick Setup.
bpy.context.preferences.view.show_splash = False
bpy.ops.wm.save_userpref()
