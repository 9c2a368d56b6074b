# SPDX-License-Identifier: GPL-3.0-or-later
"""Light from a world and from lamps, with every choice of lights: how much is reflected, and that none counts twice.

The surface is a shallow bake of the Elaphe sample, over a black base.
"""

import bpy
import numpy as np
import pytest

from laboratory.benchmarks.hemisphere import directional_albedo, directional_albedo_xyz
from precompute.colour.spaces import rgb_from_xyz
from precompute.optics.brdf import fresnel_reflectance
from precompute.optics.plate import NO_PLATE
from tests.addon.worlds.made import world_with

from .world_scenes import add_ball, add_soft_boxes, add_world, assign, look_at_ball

LUMINANCE = np.linalg.inv(rgb_from_xyz())[1]


def test_white_furnace(stage, skin):
    """A white world shows the directional albedo: within 1 % up to 75 degrees, 3 % beyond. The noise is a tenth of
    that: a pixel of 64 samples has a deviation of 7 %, and there are 1024 pixels."""
    expect_directional_albedo(stage, skin, (0, 75, 85), choices=["REST", "ALL"])


@pytest.mark.night("test_white_furnace_of_a_metal_and_of_layers")
def test_white_furnace_of_a_mirror(stage, mirror_skin):
    """It reflects most of all matters."""
    expect_directional_albedo(stage, mirror_skin, (0, 75, 85))


@pytest.mark.short("gold-75")
@pytest.mark.parametrize("degrees", [0, 60, 75, 85])
def test_white_furnace_of_a_metal_and_of_layers(stage, matter_skin, degrees):
    """A blaze, all of whose light is in a few strongly coloured orders: within 2 % up to 75 degrees, as the sample set
    misplaces up to 1 % of the light (INTERPOLATION of bake/sample_draws.py) and the noise is 0.5 %. Beyond, the noise
    is 1.3 %."""
    expect_directional_albedo(stage, matter_skin, (degrees,), samples=256, limits=(0.02, 0.05))


@pytest.mark.night("test_white_furnace")
def test_white_furnace_of_a_deep_relief(stage, deep_skin):
    """The mirror image's colour changes by a quarter within the kernel."""
    expect_directional_albedo(stage, deep_skin, (75, 80, 85))


@pytest.mark.night("tests/render/test_base.py")
def test_white_furnace_under_a_plate(stage, disc):
    """The disc's relief, and the face of its plate."""
    expect_directional_albedo(stage, disc, (0, 60, 75))


def expect_directional_albedo(stage, skin, angles_deg, *, choices=("REST",), samples=64, limits=(0.01, 0.03)):
    """The limits are relative to the luminance, up to 75 degrees and beyond. Light that the sample set misplaces takes
    the colour of the place, so the weakest component errs by a share of all light."""
    path, table = skin
    add_world(stage)
    bpy.ops.mesh.primitive_plane_add(size=20)
    assign(stage, path, choices[0])
    for degrees in angles_deg:
        theta = np.radians(degrees)
        wanted = directional_albedo(table, theta)
        # The quadrature is exact to 1e-3. The largest albedo is found to a hundredth (test_largest_albedo.py).
        assert directional_albedo_xyz(table, theta)[1] <= 1.01
        if table.plate_ior != NO_PLATE:
            wanted += fresnel_reflectance(np.cos(theta), table.plate_ior)
        limit = limits[degrees > 75] * wanted @ LUMINANCE
        for lights in choices:
            assert bpy.ops.grating.lights(lights=lights) == {"FINISHED"}
            pixels = seen(stage, "cycles", degrees, samples)
            # A dielectric's pixels are dark. Others have a mean of up to 1 and noise.
            assert table.holds_reflectance or pixels.max() <= 1
            np.testing.assert_allclose(pixels.mean(axis=0), wanted, rtol=0, atol=limit)


@pytest.mark.short("gold")
@pytest.mark.parametrize("matter_skin", ["mirror", "gold"], indirect=True)
def test_white_furnace_in_eevee(stage, matter_skin):
    """The directional albedo within 2 % up to 75 degrees, for the sample set's 1 % and GGX, and 4 % at 85; and four
    times the noise, which is 0.3 to 0.9 %. A reflectance that is blurred over all wavelengths changes gold's blue by
    10 % at the normal and by 7 % at 60 degrees."""
    path, table = matter_skin
    add_world(stage)
    bpy.ops.mesh.primitive_plane_add(size=20)
    assign(stage, path, "REST")
    for degrees in (0, 60, 75, 85):
        pixels, wanted = seen(stage, "eevee", degrees, 32), directional_albedo(table, np.radians(degrees))
        limit = (0.04 if degrees > 75 else 0.02) * wanted + 4 * pixels.std(axis=0) / 32
        assert (np.abs(pixels.mean(axis=0) - wanted) <= limit).all(), (degrees, pixels.mean(axis=0) / wanted)


def seen(stage, engine, degrees, samples) -> np.ndarray:
    """The plane's pixels (1024, 3), linear RGB, at an angle from its normal."""
    theta = np.radians(degrees)
    camera = stage.camera((2 * np.sin(theta), 0, 2 * np.cos(theta)), ortho=0.1)
    pixels = stage.rgb(engine, 32, samples).reshape(-1, 3)
    bpy.data.objects.remove(camera)
    return pixels


def test_nothing_counts_twice(stage, skin):
    """A sun, an area lamp, a world and a shining mesh light a sphere: all together give the sum of each alone, and the
    lamps give the same light as without closures. That light is compared as luminance: the table brings the colour of a
    whole lamp into the gamut, the closures that of each direction in it.

    Both within 1.5 %: the lamps' mirror images are 9 pixels wide, which samples at pixel centres integrate to a per
    cent, and the noise of 10^5 samples is less. Light that only closures see is the same for both choices that have
    them."""
    path, _ = skin
    add_ball()
    assign(stage, path, "LAMPS")
    sun = stage.lamp("SUN", to=(0.35, -0.6, 1.0), energy=3.0, angle=np.radians(16), name="Sun")
    area = stage.lamp("AREA", (-3, -3, 1), to=(-1, -1, 0.3), energy=300.0, size=1.2, name="Area")
    bpy.ops.mesh.primitive_plane_add(size=2, location=(3, -2, 0), rotation=(0, np.pi / 2, -0.6))
    material, tree = stage.material("Panel")
    panel = tree.node("ShaderNodeEmission", (1.0, 0.8, 0.5, 1.0), 2.0)
    tree.node("ShaderNodeOutputMaterial", tree.value(panel.outputs[0]))
    bpy.context.object.data.materials.append(material)
    sky = add_world(stage)
    look_at_ball(stage)

    def light(lights: str, *shown: str, samples: int = 10) -> np.ndarray:
        """The mean over the sphere, with the lights of these names."""
        assert bpy.ops.grating.lights(lights=lights) == {"FINISHED"}
        for lamp in (sun, area):
            lamp.hide_render = lamp.name not in shown
        panel.inputs["Strength"].default_value = 2.0 * ("Panel" in shown)
        sky.default_value = (*np.array((0.3, 0.4, 0.6)) * ("Sky" in shown), 1)
        return stage.rgb("cycles", 160, samples)[30:-30, 30:-30].mean(axis=(0, 1))

    parts = {name: light("REST", name) for name in ("Sun", "Area", "Panel", "Sky")}
    np.testing.assert_allclose(light("REST", *parts), sum(parts.values()), rtol=0.015)
    # As one Gaussian, the area lamp gives 1.9 % more light than by its shape, which All and closures alone confirm.
    for name, limit in (("Sun", 0.015), ("Area", 0.025)):
        lamp = light("LAMPS", name, samples=1)  # has no noise
        np.testing.assert_allclose(lamp @ LUMINANCE, parts[name] @ LUMINANCE, rtol=limit)
    for name in ("Panel", "Sky"):
        assert light("LAMPS", name, samples=1).max() == 0
        np.testing.assert_allclose(light("ALL", name), parts[name], rtol=0.015)


@pytest.mark.night("tests/render/test_sky_sun.py")
def test_the_sources_of_a_world(stage, skin):
    """Two soft boxes in a dim sky: as sources they give the light of the random closure, with less noise."""
    path, _ = skin
    add_soft_boxes(stage)
    add_ball()
    look_at_ball(stage)
    assign(stage, path, "REST")
    held = stage.addon.sky
    assert held.source_count(stage.scene) >= 2
    fitted = stage.rgb("cycles", 64, 64)[12:-12, 12:-12]
    assert held.forget_sources(stage.scene)
    found = stage.rgb("cycles", 64, 64)[12:-12, 12:-12]
    many = stage.rgb("cycles", 64, 256)[12:-12, 12:-12]
    # By the noise of 4 x 10^5 samples, and by the light that a Gaussian instead of a disc sends below the horizon.
    np.testing.assert_allclose(fitted.mean(axis=(0, 1)), many.mean(axis=(0, 1)), rtol=0.015)
    scattered = many.max(axis=-1) < 0.25  # excludes the mirror images, which come from the same closure
    assert np.abs(fitted - many)[scattered].mean() < 0.8 * np.abs(found - many)[scattered].mean()


@pytest.mark.night("tests/addon/workflow/test_when_still.py")
def test_a_world_that_changes_gives_its_sources_up(stage, skin):
    """They would stay where the light no longer is. A world of one colour has none."""
    path, _ = skin
    world, background = world_with("ShaderNodeTexSky")
    stage.scene.world = world
    bpy.ops.mesh.primitive_plane_add()
    assign(stage, path, "REST")
    held = stage.addon.sky
    assert held.source_count(stage.scene) >= 1
    assert stage.addon.fitting_worlds.unfitted_world(stage.scene) == []
    sky = background.inputs["Color"].links[0].from_node
    sky.sun_elevation += 0.3
    bpy.context.view_layer.update()
    assert held.source_count(stage.scene) == 0
    (line,) = stage.addon.fitting_worlds.unfitted_world(stage.scene)
    assert line.startswith(f"world {world.name}: its bright parts are noisy, because they are not fitted")
    assert bpy.ops.grating.fit_world() == {"FINISHED"}
    assert held.source_count(stage.scene) >= 1
    world.node_tree.nodes.remove(sky)
    bpy.context.view_layer.update()
    assert held.source_count(stage.scene) == 0
    assert stage.addon.fitting_worlds.unfitted_world(stage.scene) == []
