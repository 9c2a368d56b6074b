# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's properties follow every change of its lamps, by drivers that need neither scripts nor the extension.

What the lamps give in a render is measured in tests/render/test_lamps.py.
"""

import math

import bpy
import numpy as np
import pytest
from mathutils import Vector


def add_lamp(scene, kind="SUN", name="Lamp", collection=None, **settings):
    lamp = bpy.data.objects.new(name, bpy.data.lights.new(name, kind))
    for key, value in settings.items():
        setattr(lamp.data, key, value)
    (collection or scene.collection).objects.link(lamp)
    return lamp


def read(addon, scene, what, index=0) -> np.ndarray:
    bpy.context.view_layer.update()
    return np.array(scene[addon.pack.property_name(index, what)])


@pytest.fixture
def sun(addon, scene):
    addon.follow.follow_lamps(scene)
    return bpy.data.objects["Sun"]


@pytest.mark.parametrize("kind", ["SUN", "POINT", "SPOT", "AREA"])
def test_drivers_are_simple_expressions_whatever_the_lamp(addon, scene, kind):
    # Blender evaluates simple expressions even with scripts forbidden. It cuts off whatever exceeds 255 characters.
    deep = scene.collection
    for level in range(3):
        child = bpy.data.collections.new(f"Level {level}")
        deep.children.link(child)
        deep = child
    lamp = add_lamp(scene, kind, "Deep", deep)
    if kind == "AREA":
        lamp.data.shape = "ELLIPSE"
    addon.follow.follow_lamps(scene)
    drivers = [curve.driver for curve in scene.animation_data.drivers]
    assert len(drivers) == 2 * 16
    assert all(driver.is_simple_expression and driver.is_valid for driver in drivers)
    assert max(len(driver.expression) for driver in drivers) < 250


@pytest.mark.parametrize("scale", [(1, 1, 1), (3, 3, 3), (-1, 1, 1), (1, 1, -2)])
def test_direction_follows_parents_turns_scales_and_mirrors(addon, scene, sun, scale):
    parent = bpy.data.objects.new("Parent", None)
    scene.collection.objects.link(parent)
    parent.rotation_euler, parent.scale = (0.2, 0.9, -0.4), scale
    sun.parent, sun.rotation_euler = parent, (0.5, 0, 0.1)
    direction = Vector(read(addon, scene, "place")[:3]).normalized()
    # Single precision: a few units in the last place.
    np.testing.assert_allclose(direction, sun.matrix_world.col[2].xyz.normalized(), atol=2e-6)


def test_direction_follows_an_animation(addon, scene, sun):
    for frame, angle in ((1, 0.0), (11, 1.0)):
        sun.rotation_euler = (angle, 0, 0)
        sun.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_set(11)
    assert read(addon, scene, "place")[1] == pytest.approx(-math.sin(1.0), abs=2e-6)


def test_power_is_strength_exposure_and_colour(addon, scene, sun):
    sun.data.energy, sun.data.exposure, sun.data.color = 3.0, 1.0, (1.0, 0.5, 0.25)
    np.testing.assert_allclose(read(addon, scene, "power")[:3], [6.0, 3.0, 1.5], rtol=1e-6)
    sun.data.color = (1, 1, 1)
    sun.data.use_temperature, sun.data.temperature = True, 3000.0
    np.testing.assert_allclose(read(addon, scene, "power")[:3], 6 * np.array(sun.data.temperature_color), rtol=1e-5)


def test_what_the_render_hides_is_dark(addon, scene, sun):
    held = bpy.data.collections.new("Held")
    scene.collection.children.link(held)
    held.objects.link(sun)
    addon.follow.follow_lamps(scene)
    held.hide_render = True
    assert read(addon, scene, "power")[0] == 1  # still in the scene's own collection
    scene.collection.objects.unlink(sun)
    addon.follow.follow_lamps(scene)
    assert read(addon, scene, "power")[0] == 0
    held.hide_render = False
    assert read(addon, scene, "power")[0] == 1
    sun.hide_render = True
    assert read(addon, scene, "power")[0] == 0


def test_lamps_that_come_and_go_are_noticed(addon, scene, sun):
    follow = addon.follow
    assert follow.is_up_to_date(scene) and follow.followed_lamps(scene) == [sun]
    second = add_lamp(scene, "POINT", "Second")
    assert not follow.is_up_to_date(scene)
    assert bpy.ops.grating.update_lights() == {"FINISHED"}
    assert follow.is_up_to_date(scene) and follow.lamp_count(scene) == 2
    bpy.data.objects.remove(second)
    assert not follow.is_up_to_date(scene)
    bpy.ops.grating.update_lights()
    assert follow.lamp_count(scene) == 1


def test_too_many_lamps_are_told(addon, scene):
    for k in range(9):
        add_lamp(scene, "POINT", f"P{k}", energy=10.0 + k)
    followed = addon.follow.follow_lamps(scene)
    assert len(followed) == addon.find.LAMPS_MAX
    assert followed[0].name == "Sun" and followed[1].name == "P8"
    assert any("2 lamps too many" in line for line in addon.find.unfollowed_features(scene))


def test_instanced_lamps_are_named(addon, scene):
    bpy.data.objects.remove(bpy.data.objects["Sun"])
    stock = bpy.data.collections.new("Stock")
    add_lamp(scene, "POINT", "Bulb", stock)
    chain = bpy.data.objects.new("Chain", None)
    chain.instance_type, chain.instance_collection = "COLLECTION", stock
    scene.collection.objects.link(chain)
    bpy.context.view_layer.update()
    with pytest.raises(RuntimeError, match="Bulb; use Object > Apply > Make Instances Real"):
        bpy.ops.grating.update_lights()
