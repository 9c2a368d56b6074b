# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by Blender: `--python make_plane.py -- FILE [sky]` saves a plane, a sun and a close camera above it, and a sky.

Over the plane the directions of light and camera vary enough for a grating of 2.5 um to show whole spectra:
u| = |sin 30 deg + sin t| with t from -45 to 45 degrees.
"""

import sys
from math import radians

import bpy

bpy.ops.wm.read_homefile(use_empty=True)
bpy.ops.mesh.primitive_plane_add(size=1.0)
bpy.ops.object.light_add(type="SUN", rotation=(0, radians(30), 0))
bpy.context.object.data.energy = 3.0
bpy.ops.object.camera_add(location=(0, 0, 0.5))
bpy.context.object.data.angle = radians(90)
bpy.context.scene.camera = bpy.context.object
path, *wanted = sys.argv[sys.argv.index("--") + 1 :]
if wanted == ["sky"]:
    world = bpy.context.scene.world = bpy.data.worlds.new("Sky")
    if bpy.app.version < (5, 0, 0):
        world.use_nodes = True
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Strength"].default_value = 0.02
    sky = world.node_tree.nodes.new("ShaderNodeTexSky")
    world.node_tree.links.new(sky.outputs[0], background.inputs["Color"])
bpy.ops.wm.save_as_mainfile(filepath=path)
