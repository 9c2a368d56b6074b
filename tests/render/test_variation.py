# SPDX-License-Identifier: GPL-3.0-or-later
"""A grating that varies: shares and turn in a picture, patterns on a moving skin, and each relief alone."""

import bpy
import numpy as np
import pytest

from .test_direction_source import along, look_down, positions

PIXELS = 128
ENGINES = ["cycles", "eevee"]
# EEVEE renders to half floats, and each share is between 0 and 1.
TOLERANCE = 2**-11


def answering(addon, name, answer):
    """A Response whose radiance `answer` builds from the tree and the tangent."""
    response = addon.response
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    addon.interface.add_interface(group, (response.TANGENT,), response.ONE_RADIANCE)
    tree = addon.builder.Tree(group)
    tree.output(answer(tree, tree.inputs()["Tangent"]))
    return response.Response(group)


@pytest.fixture
def plane(stage):
    """A plane of 4 m under a sun, seen from above by a camera that sees 2 m of it."""
    bpy.ops.mesh.primitive_plane_add(size=4)
    look_down(stage, 2)
    stage.lamp("SUN", to=(0, 0, 1), energy=1.0, angle=0.0)
    return bpy.context.object


def shown(stage, mesh, engine, responses, **choice):
    """The picture of a varied skin around these responses."""
    first, *others = responses
    material, tree = stage.material("Varied")
    mesh.data.materials.clear()
    mesh.data.materials.append(material)
    group = stage.addon.skin.group_around("varied", first, shadows=False, lights="LAMPS")
    stage.addon.skin.set_variation(group, stage.addon.grating.Variation(**choice), others)
    tree.node("ShaderNodeOutputMaterial", tree.group(group, {"Base Blend": 0.0})["Shader"])
    stage.addon.lighting.update_all_lamps()
    return stage.rgb(engine, PIXELS)


@pytest.fixture
def primaries(stage):
    """Three responses that return red, green and blue, so that a pixel's colour equals its shares."""
    return [
        answering(stage.addon, str(k), lambda tree, _, k=k: tree.vector(*np.eye(3)[k])) for k in range(3)
    ]  # fmt: skip


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("softness", [0.0, 0.3])
def test_each_relief_has_its_share_of_the_surface(stage, plane, primaries, engine, softness):
    shares = (0.3, 0.2)
    picture = shown(stage, plane, engine, primaries, shares=shares, size_m=0.05, softness=softness)
    np.testing.assert_allclose(picture.sum(axis=-1), 1, atol=3 * TOLERANCE)
    if softness == 0:
        assert np.minimum(picture, 1 - picture).max() < TOLERANCE, "one relief at each place"
    # The noise is uniform within 0.015 at each bound. In 40 by 40 patches of one relief each, a share has a standard
    # deviation of sqrt(0.25 / 1600) = 0.0125, of which four are allowed.
    np.testing.assert_allclose(picture.mean(axis=(0, 1)), (0.5, *shares), atol=0.015 * 2 + 4 * 0.0125)


@pytest.mark.parametrize("engine", ENGINES)
def test_an_attribute_lays_them_out(stage, plane, primaries, engine):
    """Sharp bounds lie where the attribute equals the cumulative shares; softness fades each relief into the next."""
    plane.data.attributes.new("ramp", "FLOAT", "POINT").data.foreach_set(
        "value", [vertex.co.x / 2 + 0.5 for vertex in plane.data.vertices]
    )
    x = positions(PIXELS)[..., 0] / 2 + 0.5
    choice = {"shares": (0.25, 0.25), "pattern": "ATTRIBUTE", "attribute": "ramp"}
    sharp = shown(stage, plane, engine, primaries, **choice)
    away = (np.abs(x - 0.5) > 1 / PIXELS) & (np.abs(x - 0.75) > 1 / PIXELS)
    wanted = np.stack([x < 0.5, (x > 0.5) & (x < 0.75), x > 0.75], axis=-1)
    np.testing.assert_allclose(sharp[away], wanted[away], atol=TOLERANCE)
    soft = shown(stage, plane, engine, primaries, **choice, softness=0.2)
    steps = [np.clip((x - bound) / 0.2 + 0.5, 0, 1) for bound in (0.5, 0.75)]
    second, third = (step * step * (3 - 2 * step) for step in steps)
    # The slope of a step is 1.5 / 0.2 over the ramp, on which a position is uncertain by a hundredth of a pixel.
    atol = 3 * TOLERANCE + 1.5 / 0.2 * 0.01 / PIXELS
    np.testing.assert_allclose(soft, np.stack([1 - second, second - third, third], axis=-1), atol=atol)


def test_a_mesh_without_the_attribute_shows_the_first(stage, plane, primaries):
    picture = shown(stage, plane, "cycles", primaries, shares=(0.3, 0.3), pattern="ATTRIBUTE", attribute="ramp")
    np.testing.assert_allclose(picture, np.broadcast_to((1, 0, 0), picture.shape), atol=TOLERANCE)


@pytest.mark.parametrize("engine", ENGINES)
def test_the_direction_turns_slowly_to_either_side(stage, plane, engine):
    direction = answering(stage.addon, "direction", lambda tree, t: t.times_plus(0.5, (0.5, 0.5, 0.5)))
    most = 0.4
    still, turned = (shown(stage, plane, engine, [direction], turn=turn, size_m=0.1) * 2 - 1 for turn in (0.0, most))
    np.testing.assert_allclose(still, along(0.0, PIXELS), atol=4 * TOLERANCE)
    angle = np.arctan2(turned[..., 1], turned[..., 0])
    assert np.abs(angle).max() < most + 4 * TOLERANCE
    # Uniform to either side; over 20 by 20 patches the mean is uncertain by sqrt(1 / 400) of the spread, taken 4 times.
    assert abs(angle.mean()) < 4 * most / np.sqrt(3) / 20 and abs(angle.std() / (most / np.sqrt(3)) - 1) < 0.2
    # Between neighbouring pixels, a sixth of a patch, it changes by no more than the noise's slope allows: below 2 per
    # patch, times 2 _EVEN / 2 turns at its middle.
    assert np.abs(np.diff(angle, axis=1)).max() < most * 2 * 8.5 * 2 / PIXELS / 0.1


@pytest.mark.parametrize("engine", ENGINES)
def test_patches_ride_with_a_skin_that_moves(stage, plane, primaries, engine):
    """A shape key moves all vertices by 0.3 m; a camera that moves along sees no change."""
    plane.add_rest_position_attribute = True
    choice = {"shares": (0.3, 0.3), "size_m": 0.3, "softness": 0.5}
    before = shown(stage, plane, engine, primaries, **choice)
    plane.shape_key_add(name="Basis")
    key = plane.shape_key_add(name="Moved")
    for point in key.data:
        point.co.x += 0.3
    key.value = 1.0
    stage.scene.camera.location.x += 0.3
    after = shown(stage, plane, engine, primaries, **choice)
    # Each pixel's position is uncertain by a hundredth of a pixel, and a share changes by at most 1.5 / softness times
    # the slope of the even noise, 8.5 per patch.
    np.testing.assert_allclose(after, before, atol=2 * TOLERANCE + 0.02 * 2 / PIXELS * 1.5 / 0.5 * 8.5 / 0.3)


@pytest.mark.night("test_each_relief_has_its_share_of_the_surface")
@pytest.mark.parametrize("lights", ["REST", "ALL"])
def test_where_one_has_all_it_answers_as_it_does_alone(stage, skin, deep_skin, plane, lights):
    """Under lamps and under the world, each with the same random numbers."""
    addon = stage.addon
    stage.scene.world = bpy.data.worlds.new("White")
    plane.data.attributes.new("whole", "FLOAT", "POINT")
    first, second = (addon.direct_response.direct_response(path) for path, _ in (skin, deep_skin))
    (node,) = _material_with(stage, plane, addon.skin.group_around("alone", first, shadows=False, lights=lights))
    alone = [stage.rgb("cycles", 16, samples=4)]
    node.node_tree = addon.skin.group_around("other", second, shadows=False, lights=lights)
    alone.append(stage.rgb("cycles", 16, samples=4))
    assert np.abs(alone[1] - alone[0]).max() > 0.01 * alone[0].max(), "the two surfaces differ"
    node.node_tree = group = addon.skin.group_around("both", first, shadows=False, lights=lights)
    choice = addon.grating.Variation((0.5,), "ATTRIBUTE", "whole")
    addon.skin.set_variation(group, choice, [second])
    for value, wanted in zip((0.0, 1.0), alone, strict=True):
        plane.data.attributes["whole"].data.foreach_set("value", [value] * 4)
        plane.data.update()
        np.testing.assert_allclose(stage.rgb("cycles", 16, samples=4), wanted, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize(("engine", "lights"), [
    ("cycles", "REST"), ("cycles", "LAMPS"),
    pytest.param("eevee", "LAMPS", marks=pytest.mark.night("the same in Cycles")),
])  # fmt: skip
def test_bakes_of_one_layout_are_layers_that_answer_as_each_alone(stage, short_skin, deep_skin, engine, lights):
    """On a ball under a lamp and a world. Between two bakes one is drawn, so that the mean is their mix."""
    addon, draws = stage.addon, 64
    stage.scene.world = bpy.data.worlds.new("White")
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
    bpy.ops.object.shade_smooth()
    ball = bpy.context.object
    values = ball.data.attributes.new("whole", "FLOAT", "POINT").data
    look_down(stage, 2.2)
    stage.lamp("SUN", to=(0.3, 0.2, 1), energy=1.0, angle=0.05)
    first, second = (addon.direct_response.direct_response(path) for path, _ in (short_skin, deep_skin))

    def shown(group, value=0.0, samples=2):
        node.node_tree = group
        values.foreach_set("value", [value] * len(values))
        ball.data.update()
        return stage.rgb(engine, 32, samples=samples)

    settings = {"shadows": False, "lights": lights, "footprint": False}
    group = addon.skin.group_around("both", first, **settings)
    (node,) = _material_with(stage, ball, group)
    alone = [shown(addon.skin.group_around("alone", response, **settings)) for response in (first, second)]
    addon.skin.set_variation(group, addon.grating.Variation((0.5,), "ATTRIBUTE", "whole"), [second])
    layers = addon.response.layered_in(group)
    assert layers is not None and layers.world is not None
    apart = np.abs(alone[1] - alone[0])
    assert apart.sum() > 0.1 * alone[0].sum(), "the two surfaces differ"
    for value, wanted in zip((0.0, 1.0), alone, strict=True):
        # What the bakes may be off by, 1 % of the light, and half as much by the functions of w.
        assert np.abs(shown(group, value) - wanted).sum() < 0.015 * wanted.sum()
    if lights == "LAMPS":  # without the noise of a world
        addon.skin.set_variation(group, addon.grating.Variation((0.5,), "ATTRIBUTE", "whole", softness=1.0), [second])
        assert addon.response.layered_in(group) == layers, "it is kept"
        mixed, wanted = shown(group, 0.5, draws).sum(), sum(alone).sum() / 2
        # Each draw is off by half of the difference, so the sum by its root mean square over all draws.
        assert abs(mixed - wanted) < 5 * np.sqrt((apart**2).sum() / 4 / draws) + 0.015 * wanted


def _material_with(stage, mesh, group):
    material, tree = stage.material("Shown")
    mesh.data.materials.clear()
    mesh.data.materials.append(material)
    tree.node("ShaderNodeOutputMaterial", tree.group(group)["Shader"])
    stage.addon.lighting.update_all_lamps()
    return [node for node in material.node_tree.nodes if node.type == "GROUP"]
