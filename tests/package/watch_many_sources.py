# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by a Blender with a window: `--python watch_many_sources.py -- BAKE OTHER_BAKE PICTURE`, on make_plane.py's file.

Assigns a grating that varies between two bakes, under three suns and a world of eight sources, shows it in Rendered
mode with EEVEE, and writes the viewport's picture to PICTURE."""

import sys
from importlib import import_module
from math import radians
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).resolve().parents[2]))

from devtools.window.hands import play

BAKES, PICTURE = [Path(each) for each in sys.argv[sys.argv.index("--") + 1 : -1]], sys.argv[-1]
ADDON = "bl_ext.user_default.natural_gratings"
# Seconds for the window to draw.
PAUSE = 2.0


def set_up():
    scene = bpy.context.scene
    for turn in (15, -20):
        sun = bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))
        sun.rotation_euler.y = radians(turn)
        scene.collection.objects.link(sun)
    scene.world = bpy.data.worlds.new("Sky")
    tree = scene.world.node_tree
    sky = tree.nodes.new("ShaderNodeTexSky")
    tree.links.new(sky.outputs[0], next(node for node in tree.nodes if node.type == "BACKGROUND").inputs["Color"])
    gratings = scene.natural_gratings
    for bake in BAKES:
        made = gratings.items.add()
        made.name, made.bake_path, made.shadows = bake.stem, str(bake), False
    gratings.active_index = 0
    plane = bpy.data.objects["Plane"]
    bpy.context.view_layer.objects.active = plane
    plane.select_set(True)
    sources = import_module(f"{ADDON}.precompute.world_sources.sources")
    fit_world, sky = (
        import_module(f"{ADDON}.addon.{name}") for name in ("workflow.lights.fitting_worlds", "lamps.sky")
    )
    source = sources.Source((0.0, 0.6, 0.8), (1.0, 1.0, 1.0), 1e-3)
    fit_world.stop_fitting()
    sky.hold_sources(scene, [source] * 8, fingerprint=fit_world._fingerprint(scene), missed=0.0)
    assert bpy.ops.grating.assign() == {"FINISHED"}
    vary, variation = (
        import_module(f"{ADDON}.addon.{name}") for name in ("workflow.making_materials", "gratings.grating")
    )
    first, *others = gratings.items
    vary.vary(scene, first, variation.Variation(shares=(0.5,)), others=others)
    assert first.group["ng_sources_read"] == 8, dict(first.group)


def show():
    scene = bpy.context.scene
    scene.render.engine = "BLENDER_EEVEE"
    scene.eevee.taa_samples = 1
    scene.eevee.use_shadows, scene.world.probe_resolution = False, "128"  # both take seconds, and nothing shows them
    scene.render.resolution_x = scene.render.resolution_y = 160
    scene.view_settings.view_transform = "Standard"
    scene.render.image_settings.file_format = "PNG"
    area = next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == "VIEW_3D")
    space = area.spaces.active
    space.shading.type, space.overlay.show_overlays = "RENDERED", False
    space.region_3d.view_perspective = "CAMERA"
    region = next(r for r in area.regions if r.type == "WINDOW")
    with bpy.context.temp_override(window=bpy.context.window_manager.windows[0], area=area, region=region):
        scene.render.filepath = PICTURE
        bpy.ops.render.opengl(write_still=True, view_context=True)


def story():
    yield PAUSE
    set_up()
    yield PAUSE
    show()


play(story())
