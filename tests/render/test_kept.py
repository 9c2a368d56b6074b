# SPDX-License-Identifier: GPL-3.0-or-later
"""A surface under lamps, a sky and its sun looks the same after reopening, copying, undo and redo."""

import bpy
import numpy as np
import pytest

from tests.addon.worlds.made import world_with

from .lamp_scenes import AFTER, PIXELS, add_camera, add_grating, add_lamps, add_plane, agree, build, differs, now, save
from .test_brought_over import bring_by_operator, other_file
from .world_scenes import add_ball, add_soft_boxes, assign, look_at_ball


def add_sky(stage):
    """A sky whose sun is as bright as a lamp, and whose sky is as bright as the surface under the lamps."""
    world, background = world_with("ShaderNodeTexSky")
    background.inputs["Strength"].default_value = 0.1
    stage.scene.world = world


@pytest.mark.short("REST")
@pytest.mark.parametrize("lights", ["REST", "ALL"])
def test_opened_again_and_copied(files, skin, lights):
    add_sky(files)
    plane = build(files, skin[0], AFTER, lights)
    assert (files.addon.sky.source_count(files.scene) > 0) == (lights == "REST")
    wanted = files.rgb("cycles", PIXELS)
    slot = plane.material_slots[0]
    slot.material = slot.material.copy()
    agree(files.rgb("cycles", PIXELS), wanted)
    copy = plane.copy()
    copy.data = plane.data.copy()
    bpy.data.objects.remove(plane)
    files.scene.collection.objects.link(copy)
    agree(files.rgb("cycles", PIXELS), wanted)
    bpy.ops.scene.new(type="FULL_COPY")
    made = now(files)
    assert made.scene != files.scene
    agree(made.rgb("cycles", PIXELS), wanted)
    bpy.data.scenes.remove(files.scene)
    agree(made.rgb("cycles", PIXELS), wanted)
    bpy.ops.wm.open_mainfile(filepath=str(save(made)))
    agree(now(made).rgb("cycles", PIXELS), wanted)


@pytest.mark.short("ALL")
@pytest.mark.parametrize("chosen", ["LAMPS", "ALL"])
def test_undone_and_done_again(files, skin, chosen):
    """Undoes and redoes Assign, then another choice of lights."""
    add_sky(files)
    add_plane()
    add_camera(files)
    add_lamps(files, AFTER)
    add_grating(files, skin[0])
    shown = []

    def done():
        bpy.ops.ed.undo_push(message="a step")
        shown.append(now(files).rgb("cycles", PIXELS))

    done()
    assert bpy.ops.grating.assign() == {"FINISHED"}
    done()
    assert bpy.ops.grating.lights(lights=chosen) == {"FINISHED"}
    done()
    before, assigned, changed = shown
    differs(assigned, before)
    differs(changed, assigned)
    for step, wanted in ((bpy.ops.ed.undo, assigned), (bpy.ops.ed.undo, before), (bpy.ops.ed.redo, assigned)):
        assert step() == {"FINISHED"}
        agree(now(files).rgb("cycles", PIXELS), wanted)
    assert bpy.ops.ed.redo() == {"FINISHED"}
    agree(now(files).rgb("cycles", PIXELS), changed)


@pytest.mark.night("test_opened_again_and_copied")
@pytest.mark.parametrize("link", [False, True])
def test_sources_stay_with_their_scene(files, skin, link):
    """In a new file the ball and its world have no sources, and the random order finds all of the light. Once the world
    is fitted there too, the ball looks as before."""
    add_soft_boxes(files)
    add_ball()
    look_at_ball(files)
    assign(files, skin[0], "REST")
    held = files.addon.sky
    count = held.source_count(files.scene)
    assert count >= 2
    wanted = files.rgb("cycles", 64, 64)
    scattered = wanted.max(axis=-1) < 0.25  # the rest is mirror images
    path = save(files)
    made = other_file(files, {})
    look_at_ball(made)
    with bpy.data.libraries.load(str(path), link=link) as (_, target):
        target.worlds = ["tested"]
    (made.scene.world,) = target.worlds
    bring_by_operator(path, "Object", "Ball", link)
    assert held.source_count(made.scene) == 0
    found = made.rgb("cycles", 64, 64)
    for part in (scattered, ~scattered):
        np.testing.assert_allclose(found[part].mean(axis=0), wanted[part].mean(axis=0), rtol=0.015)
    assert bpy.ops.grating.fit_world() == {"FINISHED"}
    assert held.source_count(made.scene) == count
    agree(made.rgb("cycles", 64, 64), wanted)
