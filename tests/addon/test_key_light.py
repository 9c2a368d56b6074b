# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's properties follow the sun whatever is done to it, by drivers that need neither scripts nor extension."""

import math

import bpy
import numpy as np
import pytest
from mathutils import Euler, Vector


@pytest.fixture
def sun(addon, scene):
    sun = bpy.data.objects["Sun"]
    addon.key_light.follow_sun(scene, sun)
    return sun


def check(addon, scene, sun):
    bpy.context.view_layer.update()
    # Single precision quaternion: a few units in the last place of 1.
    to_sun = (sun.matrix_world.to_3x3() @ Vector((0, 0, 1))).normalized()
    np.testing.assert_allclose(scene[addon.key_light.direction_name(0)], to_sun, atol=2e-6)


def irradiance(addon, scene):
    bpy.context.view_layer.update()
    return np.array(scene[addon.key_light.irradiance_name(0)])


def test_drivers_are_simple_expressions(scene, sun):
    drivers = [curve.driver for curve in scene.animation_data.drivers]
    assert len(drivers) == 6
    assert all(driver.is_simple_expression and driver.is_valid for driver in drivers)


@pytest.mark.parametrize("angles", [(0, 0, 0), (0.3, 0.4, 0.5), (2.0, -1.0, 3.0)])
def test_direction_follows_a_turn(addon, scene, sun, angles):
    sun.rotation_euler = angles
    check(addon, scene, sun)


def test_direction_follows_parents_and_scale(addon, scene, sun):
    parent = bpy.data.objects.new("Parent", None)
    scene.collection.objects.link(parent)
    parent.rotation_euler, parent.scale = (0.2, 0.9, -0.4), (3, 3, 3)
    sun.parent, sun.rotation_euler = parent, Euler((0.5, 0, 0.1))
    check(addon, scene, sun)


def test_direction_follows_an_animation(addon, scene, sun):
    for frame, angle in ((1, 0.0), (11, 1.0)):
        sun.rotation_euler = (angle, 0, 0)
        sun.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_set(11)
    check(addon, scene, sun)
    assert scene[addon.key_light.direction_name(0)][1] == pytest.approx(-math.sin(1.0), abs=2e-6)


def test_irradiance_is_strength_exposure_and_colour(addon, scene, sun):
    sun.data.energy, sun.data.exposure, sun.data.color = 3.0, 1.0, (1.0, 0.5, 0.25)
    np.testing.assert_allclose(irradiance(addon, scene), [6.0, 3.0, 1.5], rtol=1e-6)


def test_irradiance_follows_the_temperature(addon, scene, sun):
    sun.data.use_temperature, sun.data.temperature = True, 3000.0
    np.testing.assert_allclose(irradiance(addon, scene), sun.data.temperature_color, rtol=1e-5)
    sun.data.use_temperature = False
    np.testing.assert_allclose(irradiance(addon, scene), 1.0, rtol=1e-6)


def test_the_strongest_visible_sun_is_found(addon, scene):
    strong = bpy.data.objects.new("Strong", bpy.data.lights.new("Strong", "SUN"))
    strong.data.energy = 9
    scene.collection.objects.link(strong)
    assert addon.key_light.find_sun(scene) == strong
    strong.hide_render = True
    assert addon.key_light.find_sun(scene).name == "Sun"
