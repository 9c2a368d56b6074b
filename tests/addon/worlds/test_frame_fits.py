# SPDX-License-Identifier: GPL-3.0-or-later
"""The frames of an animated world, fitted in a second Blender."""

import math

import numpy as np
import pytest

from tests.addon.worlds.made import world_with

UP, FIRST_TURN, LAST_TURN = 0.6, 0.2, 1.4


@pytest.mark.night("tests/addon/workflow/test_fitting_frames.py")
def test_the_sun_of_a_turning_sky_is_found_in_each_frame(addon, scene):
    world, background = world_with("ShaderNodeTexSky")
    sky = background.inputs["Color"].links[0].from_node
    sky.sun_elevation = UP
    for frame, turn in ((1, FIRST_TURN), (3, LAST_TURN)):
        sky.sun_rotation = turn
        sky.keyframe_insert("sun_rotation", frame=frame)
    scene.world = world
    try:
        job = addon.fitting_frames.FrameFits(scene, [1, 3])
        job.wait()
        assert "2 frames fitted, 1 to 3" in job.keep()
        power = {}
        for frame, turn in ((1, FIRST_TURN), (3, LAST_TURN)):
            scene.frame_set(frame)
            *direction, disc = scene["ng_world_0_place"]
            sun = (math.cos(UP) * math.sin(turn), math.cos(UP) * math.cos(turn), math.sin(UP))
            # The panorama's fit is within 0.02 degrees (test_world_probe.py).
            assert np.degrees(np.arccos(min(np.dot(direction, sun), 1))) < 0.02
            # The disc has a radius of 0.2725 degrees, and a variance of at most r^2 / 4: its limb is darker.
            assert 0.7 < (-1 - disc) / (math.radians(0.2725) ** 2 / 4) < 1.1
            power[frame] = scene["ng_world_0_power"][1]
        assert power[1] == pytest.approx(power[3], rel=0.02)
        scene.frame_set(2)
        assert scene["ng_world_0_power"][1] == 0
        assert addon.fitting_worlds.drop_stale_sources(scene) == ""
    finally:
        scene.world = None
        addon.sky.forget_sources(scene)
        scene.frame_set(1)
