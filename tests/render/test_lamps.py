# SPDX-License-Identifier: GPL-3.0-or-later
"""Calibration: with a Lambertian response, diffraction is as bright as Blender's own lamplight.

Two pictures are compared: a white diffuse plane lit by Blender, and the same plane with a Diffraction group whose
response is E cos(ti) / pi. This is done for every kind of lamp and for each setting of a lamp that changes its light.
"""

import bpy
import numpy as np
import pytest

from .lamp_scenes import lambertian

PIXELS = 24


@pytest.fixture
def both(stage, addon):
    """both(engine, samples) -> two pictures (n, n), green: Blender's lamplight by Cycles with this number of samples,
    and the Lambertian response in the engine. EEVEE's own lamplight differs from Cycles' by up to 3 % here."""

    def render(engine: str, samples: int) -> tuple[np.ndarray, np.ndarray]:
        # Off the middle, so that no symmetry hides a wrong axis.
        stage.camera((0.3, 0.2, 3), (0.3, 0.2, 0), ortho=2.0)
        bpy.ops.mesh.primitive_plane_add(size=4)
        plane = bpy.context.object
        white, tree = stage.material("White")
        diffuse = tree.node("ShaderNodeBsdfDiffuse")
        diffuse.inputs["Color"].default_value = (1, 1, 1, 1)
        tree.node("ShaderNodeOutputMaterial", tree.value(diffuse.outputs[0]))
        plane.data.materials.append(white)
        theirs = stage.rgb("cycles", PIXELS, samples, "theirs")[..., 1]

        addon.follow.follow_lamps(stage.scene)
        group = addon.skin.group_around("lambertian", lambertian(addon), shadows=False)
        ours, tree = stage.material("Ours")
        tree.node("ShaderNodeOutputMaterial", tree.group(group, {"IOR": 1.0})["Shader"])
        plane.data.materials[0] = ours
        return theirs, stage.rgb(engine, PIXELS, 1, "ours")[..., 1]

    return render


def agree(both, engine: str, tolerance: float, samples: int = 1) -> None:
    theirs, ours = both(engine, samples)
    assert theirs.max() > 0
    np.testing.assert_allclose(ours, theirs, rtol=tolerance, atol=tolerance * theirs.max() / 10)


# Relative errors for lamps without a size, where one sample has no noise. Cycles has single precision, and along a
# spot's rim a pixel's centre is uncertain by a thousandth of a pixel. EEVEE truncates to half floats: 2^-10.
EXACT = {"cycles": 1e-3, "eevee": 2e-3}
ENGINES = ["cycles", "eevee"]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("scale", [(1, 1, 1), (0.5, 1.5, 2.0)])
def test_sun(stage, both, engine, scale):
    sun = stage.lamp("SUN", to=(0.4, -0.3, 1), energy=3.0, angle=0.0, color=(0.2, 0.6, 0.9), exposure=0.5)
    sun.scale = scale
    agree(both, engine, EXACT[engine])


@pytest.mark.parametrize("engine", ENGINES)
def test_point(stage, both, engine):
    stage.lamp("POINT", (0.5, -0.4, 1.2), energy=40.0, shadow_soft_size=0.0)
    agree(both, engine, EXACT[engine])


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("scale", [(1, 1, 1), (0.5, 1.5, 0.8), (-1, 1, 1)])
def test_spot(stage, both, engine, scale):
    spot = stage.lamp("SPOT", (0.6, -0.2, 1.0), (0.3, -0.2, 1), energy=60.0, shadow_soft_size=0.0, spot_size=1.2)
    spot.data.spot_blend = 0.5
    spot.scale = scale
    agree(both, engine, EXACT[engine])


@pytest.mark.parametrize("engine", ENGINES)
def test_area(stage, both, engine):
    # The response treats the lamp as a point at its centre. For a lamp of 1 cm at 1.3 m the error is (0.01 / 1.3)^2.
    lamp = stage.lamp("AREA", (0.5, -0.4, 1.2), (0.2, -0.4, 1), energy=50.0, shape="RECTANGLE", size=0.01, size_y=0.005)
    lamp.scale = (0.7, 1.5, 1.0)
    agree(both, engine, 1e-2, samples=64)


@pytest.mark.short("cycles")
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    ("kind", "settings"),
    [
        ("SUN", {"angle": 0.2, "energy": 30.0}),
        ("POINT", {"shadow_soft_size": 0.02, "energy": 5e4}),
        ("SPOT", {"shadow_soft_size": 0.02, "energy": 5e4, "spot_size": 2.5}),
        ("AREA", {"size": 0.02, "shape": "DISK", "energy": 5e4}),
    ],
)
def test_lamps_that_are_not_normalized(stage, both, engine, kind, settings):
    # A sun of 0.2 rad is a disc: its mean cosine is off by 0.1^2 / 4, and Cycles' samples by a few thousandths.
    stage.lamp(kind, (0.3, 0.2, 1.5), (0.1, 0, 1), normalize=False, **settings)
    agree(both, engine, 2e-2, samples=256)


@pytest.mark.short("eevee")
@pytest.mark.parametrize("engine", ENGINES)
def test_two_lamps_parented_scaled_and_hidden(stage, both, engine):
    parent = stage.add("Parent", None, (0.1, 0.2, 0.3), rotation=(0.2, -0.3, 0.5), scale=(1.2, 1.2, 1.2))
    lamp = stage.lamp("POINT", (0.3, 0.1, 0.8), energy=30.0, shadow_soft_size=0.0)
    lamp.parent = parent
    stage.lamp("SUN", to=(-0.5, 0.2, 1), energy=1.0, angle=0.0, use_temperature=True, temperature=3500.0)
    hidden = stage.lamp("SUN", to=(0.5, 0.2, 1), energy=9.0)
    hidden.hide_render = True
    dark = bpy.data.collections.new("Dark")
    stage.scene.collection.children.link(dark)
    dark.hide_render = True
    stage.add("Unseen", bpy.data.lights.new("Unseen", "SUN"), collection=dark)
    # Cycles samples one lamp per sample.
    agree(both, engine, 1e-2, samples=4096)
