# SPDX-License-Identifier: GPL-3.0-or-later
"""The footprint of a pixel: the width that the nodes compute, and its effect on pictures."""

import bpy
import numpy as np
import pytest

from .test_radiance import assign, lamps

ENGINES = ["cycles", "eevee"]
FILTER_PX = 1.5
# The variance of Blackman and Harris's filter, in pixels squared.
VARIANCE = 0.0768 * FILTER_PX**2
RADIUS, PIXELS = 0.8, 64


def ball(stage):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=256, ring_count=128, radius=RADIUS)
    bpy.ops.object.shade_smooth()
    stage.filter = ("BLACKMAN_HARRIS", FILTER_PX)
    return bpy.context.object


@pytest.mark.short("cycles-orthographic", "eevee-perspective")
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("engine", ENGINES)
def test_on_a_ball_it_is_the_closed_form(stage, engine, projection):
    """Normals turn by 1 / R across the view, and by 1 / (R cosine) where the ball curves away from it."""
    mesh = ball(stage)
    material, tree = stage.material("Footprint")
    emission = tree.node("ShaderNodeEmission", stage.addon.skin_nodes.with_footprint(tree, 0.0), 1.0)
    tree.node("ShaderNodeOutputMaterial", tree.value(emission.outputs[0]))
    mesh.data.materials.append(material)
    distance = 4.0
    if projection == "orthographic":
        stage.camera((0, -distance, 0), ortho=2.0)
        pixel = 2.0 / PIXELS
    else:
        stage.camera((0, -distance, 0), angle=0.5)
        pixel = (distance - RADIUS) * 2 * np.tan(0.25) / PIXELS
    found = stage.rgb(engine, PIXELS)[PIXELS // 2, :, 0] ** 4 / 2
    aside = (np.arange(PIXELS) + 0.5 - PIXELS / 2) * pixel / RADIUS
    # In perspective the closed form holds only in the middle.
    counted = np.abs(aside) < (0.9 if projection == "orthographic" else 0.05)
    wanted = VARIANCE * (pixel / RADIUS) ** 2 * (1 + 1 / (1 - aside[counted] ** 2)) / 2
    # The ball has 256 segments. EEVEE stores normals in ten bits and takes differences of neighbouring pixels.
    np.testing.assert_allclose(found[counted], wanted, rtol=0.02 if engine == "cycles" else 0.1)


@pytest.mark.short("cycles")
@pytest.mark.parametrize("engine", ENGINES)
def test_a_spike_is_blurred_no_more_than_by_four_degrees(stage, engine):
    """A needle one pixel thick, whose normals turn by half a circle within the pixel."""
    mesh = ball(stage)
    thick = 2 * RADIUS * 0.01
    mesh.scale, mesh.location = (0.01, 0.01, 1.0), (thick / 2, 0, 0)
    material, tree = stage.material("Footprint")
    emission = tree.node("ShaderNodeEmission", stage.addon.skin_nodes.with_footprint(tree, 0.0), 1.0)
    tree.node("ShaderNodeOutputMaterial", tree.value(emission.outputs[0]))
    mesh.data.materials.append(material)
    stage.camera((0, -4, 0), ortho=thick * PIXELS)
    found = stage.rgb(engine, PIXELS)[..., 0]
    # Single precision, and half floats in EEVEE.
    rel = 1e-5 if engine == "cycles" else 2.0**-10
    assert found.max() == pytest.approx((2 * stage.addon.skin_nodes.MOST) ** 0.25, rel=rel)


@pytest.mark.short("cycles")
@pytest.mark.parametrize(
    ("engine", "samples", "shrinks"), [("cycles", (6, 96), 16), ("eevee", (4, 16), 1), ("eevee", (16, 64), 4)]
)
def test_it_shrinks_with_the_samples(stage, engine, samples, shrinks):
    """In Cycles the filter's variance divided by the samples. EEVEE uses four samples' value up to sixteen. From pixel
    to pixel the normal turns by a hundred steps of the ten bits that EEVEE stores."""
    mesh = ball(stage)
    material, tree = stage.material("Footprint")
    emission = tree.node("ShaderNodeEmission", stage.addon.skin_nodes.with_footprint(tree, 0.0), 1.0)
    tree.node("ShaderNodeOutputMaterial", tree.value(emission.outputs[0]))
    mesh.data.materials.append(material)
    stage.camera((0, -4, 0), ortho=0.6)
    few, many = (stage.rgb(engine, 4, count).mean() ** 4 for count in samples)
    assert few / many == pytest.approx(shrinks, rel=0.02)


@pytest.mark.night("test_it_shrinks_with_the_samples")
@pytest.mark.parametrize("engine", ENGINES)
def test_few_samples_are_nearer_to_the_mean(stage, skin, engine):
    """A picture with one sample per pixel, whose orders are at most a pixel wide, is close to one of many samples: its
    error is 0.01 of the error without the footprint. Most of the light is the sun's image in one pixel. This is too
    bright, as in its middle Blackman and Harris's filter is 0.967 of a Gaussian of the same variance along each axis.
    """
    mesh = ball(stage)
    stage.camera((0, -4, 0), ortho=2.0)
    lamps(stage, "sun")
    assign(stage, mesh, skin[0])
    (grating,) = stage.scene.natural_gratings.items
    stage.addon.making_materials.choose_lights(grating, "LAMPS")

    def seen(counts, engine, samples):
        grating.footprint = counts
        stage.addon.making_materials.follow_settings()
        return stage.rgb(engine, PIXELS, samples)

    truth = seen(False, "cycles", 512)
    off, on = (seen(counts, engine, 1) for counts in (False, True))
    without, with_it = (np.sqrt(np.mean((picture - truth) ** 2)) for picture in (off, on))
    print(f"{engine}: {with_it / without:.2f}, light {on.sum() / truth.sum():.3f}")
    assert with_it < 0.1 * without
    assert on.sum() == pytest.approx(truth.sum(), rel=0.04)


@pytest.mark.night("test_it_shrinks_with_the_samples")
def test_close_by_nothing_changes(stage, baked):
    """Where a pixel is far smaller than the orders, 64 samples show the same: within 1 % of the brightest."""
    mesh = ball(stage)
    stage.camera((0, -4, 0.4), (0, 0, 0.55), angle=np.radians(2))
    lamps(stage, "sun")
    assign(stage, mesh, baked[0])
    (grating,) = stage.scene.natural_gratings.items
    grating.footprint = True
    stage.addon.making_materials.follow_settings()
    on = stage.rgb("cycles", PIXELS, 64)
    grating.footprint = False
    stage.addon.making_materials.follow_settings()
    off = stage.rgb("cycles", PIXELS, 64)
    assert off.max() > 0
    np.testing.assert_allclose(on, off, atol=0.01 * off.max())
