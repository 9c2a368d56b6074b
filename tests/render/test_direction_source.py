# SPDX-License-Identifier: GPL-3.0-or-later
"""The tangent T of every source in each pixel of both engines, compared with its expected direction."""

import bpy
import numpy as np
import pytest

PIXELS = 48
# A half-float picture of (T + 2) / 4 near 3/4 has an error of 2^-12, so T of 2^-10; EEVEE interpolates tangents with 10
# bits per component, 2^-9. The tolerance is twice the sum.
TOLERANCE = 0.006


def shown(stage, mesh, engine, **choice):
    """T (n, n, 3) of a source as an engine renders it, without Rotation."""
    held = stage.addon.direction_source
    source = held.DirectionSource(combed=held.file_has_comb(), **choice)
    material, tree = stage.material("T")
    inputs = {"Normal": (0.0, 0.0, 0.0), "Tangent": (0.0, 0.0, 0.0)}
    inputs = {name: tree.value(tree.node("ShaderNodeCombineXYZ", *zero).outputs[0]) for name, zero in inputs.items()}
    inputs["Rotation"] = tree.value(tree.node("ShaderNodeValue").outputs[0])
    _, t = stage.addon.tangent_frame.frame_nodes(tree, inputs, source)
    tree.node("ShaderNodeOutputMaterial", tree.emission(t.times_plus(0.25, (0.5, 0.5, 0.5)), 1.0))
    mesh.data.materials.clear()
    mesh.data.materials.append(material)
    return stage.rgb(engine, PIXELS) * 4 - 2


def look_down(stage, width):
    """Add a camera that sees a square of this width around the origin from above, x to the right and y upwards."""
    stage.camera((0, 0, 3), ortho=width).rotation_euler = (0, 0, 0)


def positions(pixels=PIXELS):
    """The positions (n, n, 3) on the plane z = 0 that the pixels of a picture 2 m wide see from above."""
    x = (np.arange(pixels) + 0.5) / pixels * 2 - 1
    return np.stack([*np.meshgrid(x, -x), np.zeros((pixels, pixels))], axis=-1)


@pytest.fixture
def disc(stage):
    """A plane of 4 m from above, turned by 0.5 radians, with a second UV map turned by 0.3 radians."""
    bpy.ops.mesh.primitive_plane_add(size=4, rotation=(0, 0, 0.5))
    disc = bpy.context.object
    second = disc.data.uv_layers.new(name="Turned").uv
    for corner, loop in zip(second, disc.data.loops, strict=True):
        x, y, _ = disc.data.vertices[loop.vertex_index].co
        corner.vector = (x * np.cos(0.3) + y * np.sin(0.3), y * np.cos(0.3) - x * np.sin(0.3))
    look_down(stage, 2)
    return disc


def along(angle, pixels=PIXELS):
    """The unit vector at an angle from x towards y, in every pixel."""
    return np.broadcast_to((np.cos(angle), np.sin(angle), 0), (pixels, pixels, 3))


@pytest.mark.parametrize("engine", ["cycles", "eevee"])
def test_every_source_has_its_direction(stage, disc, engine):
    disc["turn"] = 0.25
    wanted = [
        ({}, along(0.5)),
        ({"kind": "UV_MAP", "uv_map": "Turned"}, along(0.5 + 0.3)),
        ({"kind": "AXIS", "axis": "Y"}, along(0.5 + np.pi / 2)),
        ({"kind": "AXIS", "axis": "X", "angle": "turn"}, along(0.5 + 0.25)),
        ({"kind": "AXIS", "axis": "X", "angle": "absent"}, along(0.5)),
    ]
    for choice, truth in wanted:
        np.testing.assert_allclose(shown(stage, disc, engine, **choice), truth, atol=TOLERANCE, err_msg=str(choice))


@pytest.mark.parametrize("engine", ["cycles", "eevee"])
def test_radial_runs_from_the_object_s_axis_outwards(stage, disc, engine):
    """Even if the object is moved, turned and scaled."""
    disc.location, disc.scale = (0.2, -0.1, 0), (2, 2, 2)
    outwards = positions() - np.array((0.2, -0.1, 0))
    distance = np.linalg.norm(outwards, axis=-1, keepdims=True)
    found = shown(stage, disc, engine, kind="RADIAL", axis="Z")
    # A pixel's position is uncertain by a hundredth of a pixel, the direction by that over the distance.
    far = distance[..., 0] > 0.1
    np.testing.assert_allclose(found[far], (outwards / distance)[far], atol=TOLERANCE + 0.01 * 2 / PIXELS / 0.1)


@pytest.mark.parametrize("engine", ["cycles", "eevee"])
def test_a_frame_map_turns_the_tangent_of_its_uv_map(stage, disc, engine):
    """From U towards N x U, even if the map is mirrored."""
    for corner in disc.data.uv_layers["Turned"].uv:
        corner.vector.y *= -1
    image = bpy.data.images.new("frames", 8, 8, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    held = (1 + np.cos(0.7)) / 2, (1 + np.sin(0.7)) / 2, 0, 1
    image.pixels.foreach_set(np.tile(np.float32(held), 64))
    image[stage.addon.direction_source.BAKED_OF] = {"uv_map": "Turned"}
    found = shown(stage, disc, engine, kind="FRAME_MAP", frame_map=image)
    np.testing.assert_allclose(found, along(0.5 + 0.3 + 0.7), atol=TOLERANCE)


@pytest.mark.parametrize("engine", ["cycles", "eevee"])
def test_an_axis_lies_on_a_bent_surface(stage, engine):
    """On a smooth sphere T is the unit vector along the axis's part at right angles to the normal."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32)
    bpy.ops.object.shade_smooth()
    look_down(stage, 1.2)
    t = shown(stage, bpy.context.object, engine, kind="AXIS", axis="X")
    place = positions() * 0.6
    n = place + np.sqrt(1 - (place**2).sum(axis=-1, keepdims=True)) * (0, 0, 1)
    truth = np.array((1.0, 0, 0)) - n * n[..., :1]
    truth /= np.linalg.norm(truth, axis=-1, keepdims=True)
    # The sphere has 32 rings: a smoothed normal is off by the sagitta of its faces, (pi / 64)^2 / 2 = 0.0012, twice.
    np.testing.assert_allclose(t, truth, atol=TOLERANCE + 0.0024)
