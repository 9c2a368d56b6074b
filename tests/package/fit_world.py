# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by a Blender with a window: `--python fit_world.py -- FOLDER`, on its startup file.

Renders, moves the cube, and fits the world's sources while the interface keeps running. Asserts that the artist's
Render Result and undo history are unchanged, and that no fit runs during a render. Reports errors by the exit status.
"""

import sys
from importlib import import_module
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).resolve().parents[2]))

from devtools.window.hands import LONG, MOMENT, play, window

FOLDER = Path(sys.argv[sys.argv.index("--") + 1])


def rendered(name):
    """The pixel values of the Render Result, as saved."""
    path = FOLDER / f"{name}.png"
    bpy.data.images["Render Result"].save_render(str(path))
    image = bpy.data.images.load(str(path))
    values = list(image.pixels)
    bpy.data.images.remove(image)
    return values


def prepare(scene):
    sky = scene.world.node_tree.nodes.new("ShaderNodeTexSky")
    background = next(node for node in scene.world.node_tree.nodes if node.type == "BACKGROUND")
    scene.world.node_tree.links.new(sky.outputs[0], background.inputs["Color"])
    background.inputs["Strength"].default_value = 0.01
    scene.render.engine, scene.cycles.samples = "CYCLES", 4
    scene.render.resolution_x, scene.render.resolution_y = 160, 120
    bpy.context.preferences.view.render_display_type = "NONE"


def story():
    probe = import_module("bl_ext.user_default.natural_gratings.addon.worlds.world_probe")
    scene, cube = bpy.context.scene, bpy.data.objects["Cube"]
    prepare(scene)
    bpy.ops.render.render()
    before = rendered("before")
    with bpy.context.temp_override(window=window()):
        bpy.ops.ed.undo_push(message="Before")
        cube.location.x = 5
        bpy.ops.ed.undo_push(message="Moved")
    names = [sorted(each.name for each in data) for data in (bpy.data.worlds, bpy.data.scenes, bpy.data.images)]

    job, ticks = probe.Probe(scene.world, scene, 4), 0
    while job.running:
        ticks += 1
        yield MOMENT
    assert ticks > 5, "the interface stood still"
    sources = job.result().sources
    assert sources and abs(sources[0].direction[2] - 0.259) < 0.01, sources  # 15 degrees is a new sky's elevation
    assert names == [sorted(each.name for each in data) for data in (bpy.data.worlds, bpy.data.scenes, bpy.data.images)]
    assert rendered("after") == before, "the Render Result is another"
    with bpy.context.temp_override(window=window()):
        bpy.ops.ed.undo()
    yield LONG
    assert bpy.data.objects["Cube"].location.x == 0, "one undo did not undo the artist's last step"

    scene = bpy.context.scene
    scene.cycles.samples, scene.cycles.use_adaptive_sampling = 4096, False
    with bpy.context.temp_override(window=window()):
        bpy.ops.render.render("INVOKE_DEFAULT")
    yield LONG
    assert bpy.app.is_job_running("RENDER")
    try:
        probe.fit_of(scene.world, scene, 4)
    except Exception as error:
        assert "not fitted while a render is running" in str(error), error
    else:
        raise AssertionError("fitted beside a render")


play(story())
