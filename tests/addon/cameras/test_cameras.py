# SPDX-License-Identifier: GPL-3.0-or-later
"""What measuring a scene's needs relies on: rays of cameras, the light of lamps, and motion."""

import math

import bpy
import numpy as np
import pytest
from mathutils import Vector


@pytest.mark.parametrize("kind", ["SUN", "POINT", "SPOT", "AREA"])
def test_lamps_send_what_their_formulas_say(addon, scene, watched, kind):
    """At the origin, from a white lamp 2 m above it: a sun of 3 W/m2, or a lamp of 100 W. The intensity is P / (4 pi),
    for an area lamp P / pi along its axis."""
    data = bpy.data.lights.new("Lamp", kind)
    data.energy = 3.0 if kind == "SUN" else 100.0
    lamp = bpy.data.objects.new("Lamp", data)
    lamp.location = (0, 0, 2)
    scene.collection.objects.link(lamp)
    bpy.data.objects.remove(bpy.data.objects["Sun"])
    if kind == "SUN":
        data.angle, variance, wanted = 0.2, math.sin(0.1) ** 2 / 4, 3.0
    elif kind == "AREA":
        data.size, variance, wanted = 0.5, 0.5**2 / 12 / 4, 100 / math.pi / 4
    else:
        data.shadow_soft_size, variance, wanted = 0.25, 0.25**2 / 4 / 4, 100 / (4 * math.pi) / 4
    addon.lighting.update_all_lamps()
    bpy.context.view_layer.update()
    places = np.array([(0.0, 0, 0), (0, 0, 4), (50, 0, 1.9)])
    (sent,) = addon.irradiance.lamps_sent(scene, watched, places)
    np.testing.assert_allclose(sent.direction[0], (0, 0, 1), atol=1e-6)
    # The scene's properties have single precision.
    assert sent.irradiance[0] == pytest.approx(wanted, rel=1e-5)
    assert sent.variance[0] == pytest.approx(variance, rel=1e-5, abs=1.2e-7)  # a sun's variance is stored as -1 - v
    if kind in ("SPOT", "AREA"):  # behind the lamp
        assert sent.irradiance[1] == 0
    if kind == "SPOT":  # outside the spot's cone
        assert sent.irradiance[2] == 0
    watched["ng_key_0_unlinked"] = 1.0
    assert addon.irradiance.lamps_sent(scene, watched, places) == []


def test_a_spots_light_rises_smoothly_over_its_blend(addon, scene, watched):
    """Blender's spot, as Cycles computes it: from the cosine of half its size over the blend's part of what is left to
    1, by 3 t^2 - 2 t^3."""
    data = bpy.data.lights.new("Spot", "SPOT")
    data.energy, data.spot_size, data.spot_blend = 4 * math.pi, math.pi / 3, 0.5
    scene.collection.objects.link(bpy.data.objects.new("Spot", data))
    bpy.data.objects.remove(bpy.data.objects["Sun"])
    addon.lighting.update_all_lamps()
    bpy.context.view_layer.update()
    rim, steps = math.cos(math.pi / 6), np.array([-0.25, 0.25, 0.5, 0.75, 1.25])
    angles = np.arccos(rim + steps * 0.5 * (1 - rim))
    (sent,) = addon.irradiance.lamps_sent(scene, watched, np.stack([np.sin(angles), 0 * angles, -np.cos(angles)], 1))
    # The two cosines have single precision, and their difference, of which it is a share, is 0.067.
    np.testing.assert_allclose(sent.irradiance, [0, 0.15625, 0.5, 0.84375, 1], atol=1e-5)


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO", "PANO"])
def test_rays_go_through_what_the_camera_shows(addon, scene, watched, kind):
    """A position in the picture and the ray through it, compared with Blender's own projection."""
    from bpy_extras.object_utils import world_to_camera_view

    camera = scene.camera
    camera.data.type, camera.data.ortho_scale, camera.data.shift_x = kind, 3.0, 0.1
    camera.rotation_euler, camera.scale = (0.2, 0.1, 0.3), (2, 2, 2)
    bpy.context.view_layer.update()
    pixels = addon.seen_surfaces.Pixels(scene, camera)
    at = np.random.default_rng(0).random((20, 2))
    origins, directions = pixels.rays(at)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, rtol=1e-12)
    if kind == "PANO":
        middle = pixels.rays(np.array([[0.5, 0.5]]))[1][0]
        np.testing.assert_allclose(middle, camera.matrix_world.to_quaternion() @ Vector((0, 0, -1)), atol=1e-6)
        return
    camera.scale = (1, 1, 1)
    bpy.context.view_layer.update()
    for place, origin, direction in zip(at, origins, directions, strict=True):
        seen = world_to_camera_view(scene, camera, Vector(origin + 3 * direction))
        np.testing.assert_allclose(seen[:2], place, atol=1e-5)  # single precision


def test_a_window_holds_what_is_seen(addon, scene, watched):
    """The plane fills part of the picture; a box behind the camera is anywhere or nowhere."""
    pixels = addon.seen_surfaces.Pixels(scene, scene.camera)
    box = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (0, 0.1)], float)
    window = pixels.window_of([(box, watched.matrix_world)])
    half = 50 / 36 / 9.9
    np.testing.assert_allclose((window.low[0], window.high[0]), (0.5 - half - 0.01, 0.5 + half + 0.01), atol=1e-5)
    places = pixels.places(window, 500)
    assert 400 < len(places) < 600 and (places >= window.low).all() and (places <= window.high).all()
    aside = [(box + (100, 0, 0), watched.matrix_world)]
    assert pixels.window_of(aside) is None
    assert pixels.window_of([(box + (0, 0, 10), watched.matrix_world)]) == addon.seen_surfaces.Window()


def test_what_moves(addon, scene, watched):
    """By keys, drivers, a moving parent or modifier object, and by modifiers that move without keys."""
    assert not addon.camera_look.moves([watched])
    parent, hook = (bpy.data.objects.new(name, None) for name in ("Parent", "Hook"))
    watched.modifiers.new("hook", "HOOK").object = hook
    watched.parent = parent
    assert not addon.camera_look.moves([watched])
    for moved in (parent, hook):
        moved.keyframe_insert("location", frame=1)
        assert addon.camera_look.moves([watched])
        moved.animation_data_clear()
    watched.modifiers.new("cloth", "CLOTH")
    assert addon.camera_look.moves([watched])


@pytest.mark.parametrize(("first", "last", "most", "wanted"), [
    (1, 1, 16, [1]), (1, 3, 16, [1, 2, 3]), (1, 250, 2, [1, 250]), (-2, 2, 3, [-2, 0, 2]), (5, 9, 1, [5]),
])  # fmt: skip
def test_frames_between(addon, scene, first, last, most, wanted):
    assert addon.camera_look.frames_between(first, last, most) == wanted
