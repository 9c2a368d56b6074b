# SPDX-License-Identifier: GPL-3.0-or-later
"""Which lamps light diffraction in a scene with too many: first lamps that the render shows, then those that send the
most light to the diffracting objects.

The diffracting plane is 2 m wide and lies at z = 0. A lamp above it is as far from the plane's box as it is high. At a
distance z a point lamp of P watts gives P / (4 pi z^2).
"""

import math

import bpy
import numpy as np
import pytest

from .conftest import add_lamp, equal_lamps

pytestmark = pytest.mark.usefixtures("eight_lamps")
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def layer_of(lamp):
    return bpy.context.view_layer.layer_collection.children[lamp.users_collection[0].name]


def under_a_hidden_parent(lamp):
    parent, (held,) = bpy.data.collections.new("Parent"), lamp.users_collection
    bpy.context.scene.collection.children.link(parent)
    bpy.context.scene.collection.children.unlink(held)
    parent.children.link(held)
    parent.hide_render = True


HIDE = {
    "collection's camera icon": lambda lamp: setattr(lamp.users_collection[0], "hide_render", True),
    "under a hidden parent": under_a_hidden_parent,
    "excluded": lambda lamp: setattr(layer_of(lamp), "exclude", True),
}


@pytest.mark.short("excluded", "hidden parent")
@pytest.mark.parametrize("way", HIDE)
def test_a_hidden_lamp_leaves_its_place_to_a_visible_one(lit, ranked, way):
    """Even if the visible one is 1000 times weaker and the hidden one is already followed."""
    lamps = equal_lamps(lit, 8, "AREA")
    add_lamp(lit, "Weak", energy=0.1)
    assert "Weak" not in ranked()
    HIDE[way](lamps[0])
    assert ranked() == [f"L{k}" for k in range(1, 8)] + ["Weak"]


def test_lamps_hidden_by_themselves_leave_their_places_too(lit, ranked):
    """By the camera's icon, by Ray Visibility, and by a scale of 0."""
    lamps = equal_lamps(lit, 8, "AREA")
    for k in range(3):
        add_lamp(lit, f"Weak{k}", energy=0.1)
    lamps[0].hide_render, lamps[1].visible_glossy, lamps[2].scale = True, False, (1, 0, 1)
    assert set(ranked()) == {*(f"L{k}" for k in range(3, 8)), "Weak0", "Weak1", "Weak2"}


def test_hidden_lamps_take_the_places_that_are_left(lit, ranked):
    """A script can then show them in a Blender without the extension. The brighter ones come first."""
    for lamp in equal_lamps(lit, 3):
        lamp.hide_render = True
    bpy.data.objects["L1"].data.energy = 10.0
    for k in range(6):
        add_lamp(lit, f"Weak{k}", energy=0.1)
    assert set(ranked()) == {"L0", "L2", *(f"Weak{k}" for k in range(6))}


def test_a_lamp_that_another_view_layer_shows_counts_as_shown(lit, ranked):
    lamps = equal_lamps(lit, 8)
    add_lamp(lit, "Weak", energy=0.1)
    second = lit.view_layers.new("Second")
    try:
        layer_of(lamps[0]).exclude = True
        assert "Weak" not in ranked()
        second.layer_collection.children["L0"].exclude = True
        assert "Weak" in ranked()
    finally:
        lit.view_layers.remove(second)


def keys(holder):
    for frame, hidden in ((1, True), (2, False)):
        holder.hide_render = hidden
        holder.keyframe_insert("hide_render", frame=frame)
    holder.hide_render = True


def strips(holder):
    keys(holder)
    animation = holder.animation_data
    animation.nla_tracks.new().strips.new("Strip", 1, animation.action)
    animation.action = None
    holder.hide_render = True


def driver(holder):
    holder.driver_add("hide_render").driver.expression = "frame < 2"
    holder.hide_render = True


@pytest.mark.parametrize("animate", [keys, strips, driver])
def test_a_lamp_of_animated_visibility_counts_as_shown(lit, ranked, animate):
    """L0, of the same strength, is permanently hidden, so L0 is dropped."""
    lamps = equal_lamps(lit, 8)
    add_lamp(lit, "Weak", energy=0.1)
    lamps[0].hide_render = True
    animate(lamps[1])
    assert set(ranked()) == {*(f"L{k}" for k in range(1, 8)), "Weak"}
    lamps[1].animation_data_clear()
    lamps[1].hide_render, lamps[0].hide_render = True, False
    assert "L1" not in ranked()


@pytest.mark.parametrize("hide", [lambda lamp: lamp.hide_set(True), lambda lamp: setattr(lamp, "hide_viewport", True)])
def test_what_only_the_viewport_hides_counts_as_shown(lit, ranked, hide):
    lamps = equal_lamps(lit, 8)
    add_lamp(lit, "Weak", energy=0.1)
    lamps[0].hide_render = True
    hide(lamps[1])
    assert set(ranked()) == {*(f"L{k}" for k in range(1, 8)), "Weak"}


def test_a_near_weak_lamp_comes_before_far_strong_ones(lit, ranked):
    """1 W at 1 m is 10 times as bright there as 1000 W at 100 m, and 8 times as bright as a sun of 0.01 W/m2."""
    for k in range(8):
        add_lamp(lit, f"Far{k}", energy=1000.0, height=100.0)
    add_lamp(lit, "Sun", "SUN", energy=0.01)
    add_lamp(lit, "Near", energy=1.0, height=1.0)
    assert set(ranked()) == {"Sun", "Near", *(f"Far{k}" for k in range(6))}


@pytest.mark.parametrize("normalize", [True, False])
def test_strength_is_the_power_that_drivers_give_over_the_squared_distance(addon, lit, normalize):
    own = {"SUN": {"angle": 0.2}, "POINT": {"shadow_soft_size": 0.3}, "SPOT": {"shadow_soft_size": 0.3}}
    common = {"exposure": 1.5, "color": (0.9, 0.4, 0.2), "use_temperature": True, "temperature": 3500.0}
    for kind in ("SUN", "POINT", "SPOT", "RECTANGLE", "DISK", "ELLIPSE", "SQUARE"):
        size = own.get(kind, {"shape": kind, "size": 0.3, "size_y": 0.7})
        data = "AREA" if "shape" in size else kind
        lamp = add_lamp(lit, "Lamp", data, energy=7.0, height=3.0, normalize=normalize, **common, **size)
        lamp.scale = (2.0, 0.5, 1.5)
        addon.lighting.update_lamps(lit)
        bpy.context.view_layer.update()
        power = np.array(lit[addon.lamp_drivers.property_name(0, "power")])[:3] @ LUMINANCE
        strength = addon.brightest_lamps.irradiances([lamp], addon.lighting.lit_boxes(lit))
        # Blender's properties have single precision: seven digits.
        np.testing.assert_allclose(strength, power / (1 if kind == "SUN" else 9), rtol=1e-6, err_msg=kind)
        bpy.data.objects.remove(lamp)


def test_the_nearest_point_of_an_object_counts(addon, lit):
    """On a plane 40 m long, whose middle is 10 times as far as its end; on a turned one; on the nearer of two."""
    plane = next(o for o in lit.objects if o.type == "MESH")
    plane.scale = (20, 1, 1)
    lamp = add_lamp(lit, "Lamp", energy=4 * math.pi, height=2.1)
    lamp.location.x = 20.0

    def distance() -> float:
        bpy.context.view_layer.update()
        return addon.brightest_lamps.irradiances([lamp], addon.lighting.lit_boxes(lit))[0] ** -0.5

    # In metres, to single precision.
    assert distance() == pytest.approx(2.1, rel=1e-6)
    plane.rotation_euler = (0, 0, math.pi / 2)
    assert distance() == pytest.approx(math.hypot(19, 2.1), rel=1e-6)
    second = plane.copy()
    second.location, second.scale, second.rotation_euler = (20, 0, 1), (1, 1, 1), (0, 0, 0)
    lit.collection.objects.link(second)
    assert distance() == pytest.approx(1.1, rel=1e-6)


def test_a_lamp_inside_an_object_is_a_tenth_of_its_half_diagonal_away(addon, lit):
    """On the plane, whose half diagonal is sqrt(2) m; on a plane of zero size the strength stays finite."""
    plane = next(o for o in lit.objects if o.type == "MESH")
    lamp = add_lamp(lit, "Lamp", energy=4 * math.pi, height=0.0)
    bpy.context.view_layer.update()
    strength = addon.brightest_lamps.irradiances([lamp], addon.lighting.lit_boxes(lit))[0]
    assert strength == pytest.approx(1 / 0.02, rel=1e-6)
    plane.scale = (0, 0, 0)
    bpy.context.view_layer.update()
    assert np.isfinite(addon.brightest_lamps.irradiances([lamp], addon.lighting.lit_boxes(lit))).all()


def test_only_objects_of_the_scene_that_show_diffraction_count(addon, lit):
    plane = next(o for o in lit.objects if o.type == "MESH")
    bpy.ops.mesh.primitive_cube_add(location=(5, 0, 0))
    elsewhere = plane.copy()
    other = bpy.data.scenes.new("Other")
    other.collection.objects.link(elsewhere)
    try:
        bpy.context.view_layer.update()
        np.testing.assert_allclose(addon.lighting.lit_boxes(lit), [[[-1, -1, 0], [1, 1, 0]]], atol=1e-6)
        plane.data.materials.clear()
        assert addon.lighting.lit_boxes(lit).shape == (0, 2, 3)
    finally:
        bpy.data.scenes.remove(other)


def test_until_an_object_shows_diffraction_lamps_are_compared_from_3_metres(addon, scene):
    """There a point lamp of 4 pi 9 W gives 1 W/m2, wherever it is."""
    sun = bpy.data.objects["Sun"]
    for k in range(7):
        add_lamp(scene, f"Strong{k}", energy=1e4, height=50.0)
    point = add_lamp(scene, "Point", energy=4 * math.pi * 9 * 0.9, height=1.0)
    assert point not in addon.brightest_lamps.brightest(scene) and sun in addon.brightest_lamps.brightest(scene)
    point.data.energy = 4 * math.pi * 9 * 1.1
    assert point in addon.brightest_lamps.brightest(scene) and sun not in addon.brightest_lamps.brightest(scene)


def test_a_lamp_takes_the_place_of_a_followed_one_only_if_it_is_clearly_brighter(addon, lit, ranked):
    """Brighter by a factor of 1.5. New lamps come after the ones already followed."""
    lamps = equal_lamps(lit, 8)
    lamps[3].data.energy = 90.0
    moved = add_lamp(lit, "Moved", energy=100.0, height=4.0)
    first = ranked()
    assert "Moved" not in first
    before = [curve.as_pointer() for curve in lit.animation_data.drivers]
    for factor in (0.9, 1.1, 1.4):
        moved.location.z = 2.0 / math.sqrt(0.9 * factor)
        assert ranked() == first
    assert [curve.as_pointer() for curve in lit.animation_data.drivers] == before, "drivers were written without need"
    moved.location.z = 2.0 / math.sqrt(0.9 * 1.6)
    assert ranked() == [name for name in first if name != "L3"] + ["Moved"]
    moved.location.z = 2.0 / math.sqrt(0.9 / 1.4)
    assert "Moved" in ranked()
    moved.location.z = 2.0 / math.sqrt(0.9 / 1.6)
    assert "Moved" not in ranked()


def test_nothing_is_measured_while_all_lamps_fit(addon, lit, monkeypatch):
    lamps = equal_lamps(lit, 8)
    asked = []
    monkeypatch.setattr(addon.material, "boxes_showing", lambda scene: asked.append(scene) or np.empty((0, 2, 3)))
    addon.lighting.update_lamps(lit)
    assert not asked and set(addon.follow.followed_lamps(lit)) == set(lamps)
    add_lamp(lit, "Ninth")
    addon.lighting.update_lamps(lit)
    assert asked


def test_saving_keeps_the_choice(addon, lit, ranked):
    equal_lamps(lit, 8)
    add_lamp(lit, "Near", energy=10.0, height=0.3)
    first = ranked()
    assert "Near" in first
    addon.handlers.show_what_is_saved()
    assert [lamp.name for lamp in addon.follow.followed_lamps(lit)] == first


def test_lamps_that_are_left_out_are_named_if_the_render_shows_them(addon, lit, ranked):
    lamps = equal_lamps(lit, 8)
    for name in ("B", "A", "Hidden"):
        add_lamp(lit, name, energy=0.1)
    bpy.data.objects["Hidden"].hide_render = True
    ranked()

    def told():
        return addon.lighting.warnings_about(lit, bpy.context.evaluated_depsgraph_get())

    assert any(line.startswith("diffraction uses at most 8 lamps; left out: A, B; choose") for line in told())
    for lamp in lamps[:2]:
        lamp.hide_render = True
    ranked()
    assert not any("left out" in line for line in told())
