# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by Blender with the zip installed, or first to install it: `--python other_version.py -- FILE PICTURE [BAKE]`.

With a bake, saves a file with a plane that shows it, under an overhead sun and a card that shades the half of the plane
where x > 0. Without a bake, opens that file. Then renders PICTURE, an EXR of 32 x 32 pixels."""

import sys

import bpy

file, picture, *bake = sys.argv[sys.argv.index("--") + 1 :]
if bake:
    bpy.ops.wm.read_homefile(use_empty=True)
    scene = bpy.context.scene
    for name, size, place in (("Card", 4, (2, 0, 5)), ("Plane", 2, (0, 0, 0))):  # the last one is selected
        bpy.ops.mesh.primitive_plane_add(size=size, location=place)
        bpy.context.object.name = name
    sun = bpy.data.lights.new("Sun", "SUN")
    sun.energy, sun.angle = 3.0, 0.0
    scene.collection.objects.link(bpy.data.objects.new("Sun", sun))
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.camera.location, scene.camera.data.angle = (0, 0, 1), 1.5
    scene.collection.objects.link(scene.camera)
    grating = scene.natural_gratings.items.add()
    grating.name, grating.bake_path = "waves", bake[0]
    bpy.ops.grating.lights(lights="LAMPS")
    bpy.ops.grating.assign()
    bpy.ops.wm.save_as_mainfile(filepath=file)
else:
    bpy.ops.wm.open_mainfile(filepath=file)
    scene = bpy.context.scene
render = scene.render
render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 4
scene.cycles.use_denoising, scene.cycles.shading_system = False, bpy.app.version < (5, 1, 0)
render.resolution_x = render.resolution_y = 32
if bpy.app.version >= (5, 0, 0):
    render.image_settings.media_type = "IMAGE"
render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
render.filepath = picture
bpy.ops.render.render(write_still=True)
