# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by Blender: `--python make_unseen.py -- FILE` saves an artist's file, made without the extension.

Scene Still: a plane, a ball with its own Principled material, and three renamed lamps, one parented to a rotated empty,
all animated. Scene Other: the same objects, other lamps.
"""

import sys
from math import radians

import bpy


def lamp(kind, name, location, rotation, energy):
    bpy.ops.object.light_add(type=kind, location=location, rotation=[radians(angle) for angle in rotation])
    made = bpy.context.object
    made.name, made.data.energy = name, energy
    return made


def animate(thing, path, *values):
    """Insert keyframes at frames 1 and 11."""
    for frame, value in zip((1, 11), values, strict=True):
        setattr(thing, path, value)
        thing.keyframe_insert(path, frame=frame)


def paint():
    """The artist's own material."""
    material = bpy.data.materials.new("Old Paint")
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    base = next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED")
    base.inputs["Base Color"].default_value = (0.02, 0.1, 0.3, 1)
    base.inputs["Roughness"].default_value = 0.45
    return material


bpy.ops.wm.read_homefile(use_empty=True)
still = bpy.context.scene
still.name = "Still"
bpy.ops.mesh.primitive_plane_add(size=1.2)
bpy.context.object.name = "Floor"
bpy.ops.mesh.primitive_uv_sphere_add(radius=0.15, location=(0, 0, 0.2))
bpy.ops.object.shade_smooth()
ball = bpy.context.object
ball.name = "Ball"
ball.data.materials.append(paint())

window = lamp("SUN", "Window", (0, 0, 2), (0, 30, 0), 3.0)
animate(window, "rotation_euler", (0, radians(30), 0), (0, radians(15), radians(20)))
bulb = lamp("POINT", "Bulb", (-0.6, 0.4, 1.0), (0, 0, 0), 20.0)
animate(bulb.data, "color", (1, 0.9, 0.8), (0.5, 0.7, 1))
torch = lamp("SPOT", "Torch", (-0.5, -0.4, 1.2), (20, 15, 0), 40.0)
bpy.ops.object.empty_add(rotation=(0, 0, radians(25)))
torch.parent = bpy.context.object
animate(torch.parent, "location", (0.9, 0, 0), (0.8, 0.2, 0.1))

bpy.ops.object.camera_add(location=(0, -0.25, 0.8), rotation=(radians(15), 0, 0))
camera = still.camera = bpy.context.object
camera.data.angle = radians(75)

other = bpy.data.scenes.new("Other")
other.camera = camera
for thing in (bpy.data.objects["Floor"], ball, camera):
    other.collection.objects.link(thing)
other.collection.objects.link(bpy.data.objects.new("Moon", bpy.data.lights.new("Moon", "SUN")))

for scene in (still, other):
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 1
    scene.cycles.seed = 1
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.render.resolution_x = scene.render.resolution_y = 48
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
still.frame_set(1)
bpy.ops.object.select_all(action="DESELECT")
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[sys.argv.index("--") + 1])
