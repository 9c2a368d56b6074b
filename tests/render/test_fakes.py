# SPDX-License-Identifier: GPL-3.0-or-later
"""The fakes of `./dev bench lights --part fakes`: each matches its description, and they are compared as described."""

import bpy
import numpy as np
import pytest

from laboratory.benchmarks import lights_fakes as fakes
from laboratory.benchmarks import lights_scenes as scenes
from laboratory.benchmarks.lights_worlds import Worlds
from precompute.colour.spaces import rgb_from_xyz
from precompute.methods.gem import Gem
from precompute.methods.method import Settings

PERIOD_M = 1.15e-6


@pytest.fixture
def studio(stage, skin):
    """The benchmark's studio, with a plane under a camera that looks down."""
    studio = Worlds(stage.addon, stage.folder, 16, skin[0])
    scenes.build(studio, "disc")
    camera = studio.scene.camera
    camera.data.type, camera.data.ortho_scale = "ORTHO", 0.01
    camera.location, camera.rotation_euler = (0, 0, 1), (0, 0, 0)
    return studio


def shown(studio, material, degrees: float) -> np.ndarray:
    """The radiance (3,) of the plane along the normal, under a sun of 1 W/m2 tilted along U."""
    bpy.data.batch_remove([lamp for lamp in bpy.data.objects if lamp.type == "LIGHT"])
    data = bpy.data.lights.new("Sun", "SUN")
    data.energy, data.angle = 1.0, 0.0
    sun = bpy.data.objects.new("Sun", data)
    sun.rotation_euler = (0, np.radians(degrees), 0)
    studio.scene.collection.objects.link(sun)
    studio.addon.lighting.update_lamps(studio.scene)
    studio.mesh.material_slots[0].material = material
    return studio.render("cycles", 64)[1].mean(axis=(0, 1))


def test_a_lobe_of_each_colour_is_where_its_order_is(studio):
    """A mirror's half vector leans by lambda / 2 d: red light comes from 30 degrees, blue light from 23."""
    material = fakes.three_lobes(studio, PERIOD_M)
    far, near = shown(studio, material, 45), shown(studio, material, 10)
    assert far[0] > far[1] > far[2] > 0
    assert near[2] > near[1] > near[0] > 0
    assert shown(studio, material, -30).max() < 0.5 * shown(studio, material, 30).max(), "one side only"


@pytest.mark.parametrize("degrees", [0, 25, -40])
def test_the_rainbow_is_that_of_the_method(studio, degrees):
    """The same formula as in precompute.methods, in single precision."""
    picture = shown(studio, fakes.rainbow(studio, PERIOD_M), degrees)
    half = np.array((np.sin(np.radians(degrees)), 0, np.cos(np.radians(degrees)) + 1))
    xyz = Gem(PERIOD_M, Settings()).xyz(*half[:, None])[0]
    np.testing.assert_allclose(picture, rgb_from_xyz("Rec.709") @ xyz, rtol=1e-3, atol=1e-4)


def test_the_film_has_colours(studio):
    red, green, blue = shown(studio, fakes.thin_film(studio), 20)
    assert max(red, green, blue) > 1.1 * min(red, green, blue) > 0


def test_the_rainbow_alone_takes_suns_for_the_world_s_sources(studio):
    scenes.light_by(studio, "studio")
    count = studio.addon.follow.lamp_count
    fakes.wear(studio, "rainbow", bake=studio.bake, period_m=PERIOD_M)
    suns = [lamp for lamp in bpy.data.objects if lamp.type == "LIGHT"]
    assert 3 <= len(suns) == count(studio.scene) <= 4
    power = sum(sun.data.energy * np.array(sun.data.color) for sun in suns)
    sources = studio.addon.world_probe.fit_of(studio.scene.world, studio.scene, 4).sources
    np.testing.assert_allclose(power, sum(source.irradiance for source in sources), rtol=1e-3)
    fakes.wear(studio, "thin film", bake=studio.bake, period_m=PERIOD_M)
    assert count(studio.scene) == 0


def test_a_fake_is_judged_at_the_light_of_the_integrals():
    expected = np.random.default_rng(1).random((50, 3))
    row = fakes.fitted(np.stack([2 * expected] * 2), expected)
    assert row["light"] == pytest.approx(2) and row["de_p95"] < 1e-9
    black = fakes.fitted(np.zeros((2, 50, 3)), expected)
    assert black["light"] == 0 and black["de_median"] > 20
