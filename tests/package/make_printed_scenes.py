# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by Blender: `--python make_printed_scenes.py -- FILE NAME ...` saves files, each with a mesh of a name, which is
the active object, a camera above it, two lamps, and a stroke."""

import sys
from math import radians

import bpy

words = sys.argv[sys.argv.index("--") + 1 :]
for file, name in zip(words[::2], words[1::2], strict=True):
    bpy.ops.wm.read_homefile(use_empty=True)
    bpy.ops.curve.primitive_bezier_curve_add(radius=0.3)
    bpy.context.object.name = "Stroke"
    for kind in ("SUN", "SPOT"):
        bpy.ops.object.light_add(type=kind, location=(1, 0, 3), rotation=(0, radians(30), 0))
    bpy.ops.object.camera_add(location=(0, 0, 3))
    scene = bpy.context.scene
    scene.camera = bpy.context.object
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.render.resolution_x, scene.render.resolution_y = 1, 64, 64
    bpy.ops.mesh.primitive_grid_add(size=1, x_subdivisions=8, y_subdivisions=8)
    bpy.context.object.name = name
    bpy.context.object.data.attributes.new("scale_random", "FLOAT", "FACE")
    bpy.ops.wm.save_as_mainfile(filepath=file)
