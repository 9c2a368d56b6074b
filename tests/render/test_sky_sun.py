# SPDX-License-Identifier: GPL-3.0-or-later
"""The sun lamp in place of a sky's disc: in Cycles the light stays, and in EEVEE it becomes that of Cycles."""

import math

import bpy
import numpy as np
import pytest

from tests.addon.worlds.made import world_with

from .lamp_scenes import add_grating

# Of the ridges of the Elaphe sample along the body.
PERIOD = 1144e-9


@pytest.fixture
def sky(stage):
    """A sky whose sun stands 40 degrees high, and nothing else."""
    stage.scene.world, background = world_with("ShaderNodeTexSky")
    background.inputs["Strength"].default_value = 0.1
    node = background.inputs["Color"].links[0].from_node
    node.sun_elevation, node.sun_rotation = math.radians(40), math.radians(200)
    yield node
    stage.scene.world = None


@pytest.mark.night("test_a_grating")
def test_a_white_plane(stage, sky):
    bpy.ops.mesh.primitive_plane_add(size=2)
    material, tree = stage.material("White")
    tree.node("ShaderNodeOutputMaterial", tree.value(tree.node("ShaderNodeBsdfDiffuse").outputs[0]))
    bpy.context.object.data.materials.append(material)
    stage.camera((0, 0, 3), ortho=0.5)

    def light(engine) -> np.ndarray:
        return stage.rgb(engine, 8, 128 if engine == "cycles" else 16).mean(axis=(0, 1))

    before, dark = light("cycles"), light("eevee")
    assert bpy.ops.grating.add_sky_sun() == {"FINISHED"}
    after, lit = light("cycles"), light("eevee")
    print(f"Cycles {before} -> {after}, EEVEE {dark} -> {lit}")
    assert after == pytest.approx(before, rel=0.03)
    draws_disc = stage.addon.compat.EEVEE_DRAWS_SUN_DISC
    assert (dark < 0.5 * before).all() != draws_disc
    # EEVEE's own light of a sky on a plane differs by a few per cent.
    assert lit == pytest.approx(before, rel=0.05)
    assert not draws_disc or dark == pytest.approx(before, rel=0.07)


def test_a_grating(stage, sky, skin):
    """A plane with a snake's scan, seen where a first order of the sun meets the camera."""
    bpy.ops.mesh.primitive_plane_add(size=2)
    add_grating(stage, skin[0])
    assert bpy.ops.grating.assign() == {"FINISHED"}  # fits the world
    up, around = sky.sun_elevation, sky.sun_rotation
    to_sun = np.array((math.cos(up) * math.sin(around), math.cos(up) * math.cos(around), math.sin(up)))
    # u of the sum of both directions is the wavelength over the strongest period, v is 0.
    x, y = -550e-9 / PERIOD - to_sun[0], -to_sun[1]
    stage.camera(3 * np.array((x, y, math.sqrt(1 - x * x - y * y))), ortho=0.2)

    def light() -> np.ndarray:
        return stage.rgb("cycles", 8, 16).mean(axis=(0, 1))

    before = light()
    assert bpy.ops.grating.add_sky_sun() == {"FINISHED"}
    after = light()
    print(f"Cycles {before} -> {after}")
    assert before.max() > 0.1
    # The lamp has the disc's irradiance within 2 % and its place within 0.02 degrees.
    assert after == pytest.approx(before, rel=0.03)
