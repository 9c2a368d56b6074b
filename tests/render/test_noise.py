# SPDX-License-Identifier: GPL-3.0-or-later
"""The noise of the random order is white and bounded, and changes to a scene do not change its mean.

The surface is a plane in a white world. Its samples are independent, so the correlation of two sets of n pixels has a
standard deviation of 1 / sqrt(n), whatever the noise's distribution. Bounds are five standard deviations.
"""

from itertools import combinations

import bpy
import numpy as np
import pytest

from precompute.colour.observer import drawn_weight, wavelength_quantiles
from precompute.colour.spaces import rgb_from_xyz
from precompute.optics.brdf import scattering_factor
from precompute.table import sample_set

from .lamp_scenes import add_plane
from .world_scenes import add_world, assign

PIXELS, SAMPLES = 48, 4
VIEWS = {
    "straight": (0, {"ortho": 0.1}),
    "at an angle": (60, {"ortho": 0.1}),
    "straight, perspective": (0, {"angle": 0.5}),
    "at an angle, perspective": (60, {"angle": 0.5}),
}
LIGHTS = pytest.mark.parametrize("lights", ["REST", "ALL"])


def plane_in_white_world(stage, path, lights: str):
    """Build the plane, seen along its normal."""
    add_world(stage)
    bpy.ops.mesh.primitive_plane_add(size=20)
    plane = bpy.context.object
    assign(stage, path, lights)
    stage.camera((0, 0, 2), ortho=0.1)
    return plane


def look(stage, degrees, **kind):
    """View the plane at an angle to its normal."""
    theta = np.radians(degrees)
    bpy.data.objects.remove(stage.scene.camera)
    stage.camera((2 * np.sin(theta), 0, 2 * np.cos(theta)), **kind)


def grey(stage, pixels=PIXELS, samples=SAMPLES, engine="cycles") -> np.ndarray:
    """The sum of the channels; asserts that all values are finite."""
    picture = stage.rgb(engine, pixels, samples)
    assert np.isfinite(picture).all()
    return picture.sum(axis=-1)


def correlation(noise: np.ndarray, other: np.ndarray) -> float:
    return np.corrcoef(noise.ravel(), other.ravel())[0, 1]


def has_no_stripes(noise: np.ndarray) -> None:
    """Assert that a pixel is uncorrelated with pixels up to 8 away in its row or column, and that the means of rows and
    columns vary no more than means of independent pixels."""
    noise = noise - noise.mean()
    rows, cols = noise.shape
    for lag in range(1, 9):
        for far, near in ((noise[:, lag:], noise[:, :-lag]), (noise[lag:], noise[:-lag])):
            assert abs(correlation(far, near)) < 5 / np.sqrt(far.size), lag
    # The mean square of n independent means is the noise's variance over n, with a relative deviation of sqrt(2 / n).
    for axis, n in ((0, rows), (1, cols)):
        share = n * np.mean(noise.mean(axis=axis) ** 2) / noise.var()
        assert share < 1 + 5 * np.sqrt(2 / noise.shape[1 - axis]), axis


def have_one_mean(*pictures: np.ndarray) -> None:
    """Assert equal means within five standard errors."""
    for one, other in combinations(pictures, 2):
        assert abs(one.mean() - other.mean()) < 5 * np.sqrt(one.var() / one.size + other.var() / other.size)


def test_stripes_are_found():
    """Checks the measure itself: noise passes, and weak stripes fail."""
    noise = np.random.default_rng(0).exponential(size=(PIXELS, PIXELS))
    has_no_stripes(noise)
    for stripes in (np.resize([0.0, 0.5], PIXELS), np.random.default_rng(1).normal(scale=0.3, size=PIXELS)):
        for striped in (noise + stripes, noise + stripes[:, None]):
            with pytest.raises(AssertionError):
                has_no_stripes(striped)


@pytest.mark.short("REST")
@LIGHTS
def test_a_flat_surface_has_no_stripes(stage, skin, lights):
    plane_in_white_world(stage, skin[0], lights)
    for degrees, kind in VIEWS.values():
        look(stage, degrees, **kind)
        has_no_stripes(grey(stage) - grey(stage, samples=32))


@LIGHTS
def test_seeds_give_other_noise_and_one_mean(stage, skin, lights):
    """Cycles puts a pixel's first sample at the centre, whatever the seed: one of n is equal."""
    plane_in_white_world(stage, skin[0], lights)
    samples, pictures = 16, []
    for stage.scene.cycles.seed in (0, 1, 2):
        pictures.append(grey(stage, samples=samples))
    for one, other in combinations(pictures, 2):
        assert correlation(one, other) < 1 / samples + 5 / PIXELS
    have_one_mean(*pictures)


@LIGHTS
def test_tiles_leave_the_picture_as_it_is(stage, skin, lights):
    plane_in_white_world(stage, skin[0], lights)
    cycles = stage.scene.cycles
    cycles.use_auto_tile = False
    whole = grey(stage)
    cycles.use_auto_tile, cycles.tile_size = True, 16
    np.testing.assert_array_equal(grey(stage), whole)


@pytest.mark.short("REST")
@LIGHTS
def test_noise_of_an_animation(stage, skin, lights):
    """It stays fixed to the surface unless the artist animates the seed."""
    plane_in_white_world(stage, skin[0], lights)
    frames = {}
    for animated in (False, True):
        stage.scene.cycles.use_animated_seed = animated
        for frame in (1, 2):
            stage.scene.frame_set(frame)
            frames[animated, frame] = grey(stage, samples=16)
    stage.scene.cycles.use_animated_seed = False
    np.testing.assert_array_equal(frames[False, 1], frames[False, 2])
    assert correlation(frames[True, 1], frames[True, 2]) < 1 / 16 + 5 / PIXELS


@LIGHTS
def test_instances_do_not_share_noise(stage, skin, lights):
    """Two objects of one mesh, and instances of a collection that holds the first."""
    add_world(stage)
    first = add_plane()  # 2 x 2
    first.location = (-1, -1, 0)
    assign(stage, skin[0], lights)
    stage.add("Second", first.data, (1, -1, 0))
    held = bpy.data.collections.new("Held")
    held.objects.link(first)
    for x in (0, 2):
        made = stage.add("Instance", None, (x, 2, 0))
        made.instance_type, made.instance_collection = "COLLECTION", held
    stage.camera((0, 0, 5), ortho=4)
    picture = grey(stage, 64)
    quarters = [picture[rows, cols] for rows in (slice(32), slice(32, 64)) for cols in (slice(32), slice(32, 64))]
    have_one_mean(*quarters)
    for one, other in combinations(quarters, 2):
        assert abs(correlation(one, other)) < 5 / 32


@pytest.mark.night("test_seeds_give_other_noise_and_one_mean")
@LIGHTS
def test_motion_and_subdivision_leave_the_mean_alone(stage, skin, lights):
    plane = plane_in_white_world(stage, skin[0], lights)
    still = grey(stage, samples=16)
    plane.modifiers.new("Subdivision", "SUBSURF").render_levels = 3
    divided = grey(stage, samples=16)
    plane.modifiers.clear()
    for frame, x in ((0, -1.0), (2, 1.0)):
        plane.location.x = x
        plane.keyframe_insert("location", frame=frame)
    stage.scene.render.use_motion_blur = True
    moving = grey(stage, samples=16)
    stage.scene.render.use_motion_blur = False
    have_one_mean(still, divided, moving)
    assert abs(correlation(still, moving)) < 5 / PIXELS  # it did move


def most_of_a_draw(draws, theta_r: float) -> float:
    """An upper bound for every sample of the closure in a world of radiance 1: the formula of
    addon/materials/lobes/lobes_group.py with each factor at its largest."""
    cos_r, cos_i = np.cos(theta_r), np.geomspace(1e-4, 1, 400)
    turn, cos_i = np.meshgrid(np.linspace(0, 2 * np.pi, 64), cos_i)
    sine = np.sqrt(1 - cos_i**2)
    wi, wr = np.stack([sine * np.cos(turn), sine * np.sin(turn), cos_i], axis=-1), np.array([np.sin(theta_r), 0, cos_r])
    factor = (scattering_factor(wi, np.broadcast_to(wr, wi.shape)) / cos_i).max()
    weight = 0.0
    for wavelength in wavelength_quantiles(64):
        s = np.linspace(cos_r, 1 + cos_r, 16) / wavelength
        weight = max(weight, max(draws.weights(each).max() for each in s) / wavelength**2)
    colour = rgb_from_xyz().max() * drawn_weight()
    return colour * weight * factor


@LIGHTS
def test_no_value_is_beyond_its_bound(stage, skin, lights):
    """Single samples, none of which is negative. The mirror image adds at most 1."""
    path, _ = skin
    draws = sample_set.read(sample_set.path_beside(path))[0]
    plane_in_white_world(stage, path, lights)
    for degrees in (0, 75):
        look(stage, degrees, ortho=0.1)
        picture = stage.rgb("cycles", 128, 1)
        assert 0 <= picture.min() and picture.max() <= 1 + most_of_a_draw(draws, np.radians(degrees))


@pytest.mark.night("test_no_value_is_beyond_its_bound")
def test_noise_in_eevee(stage, skin):
    plane_in_white_world(stage, skin[0], "REST")
    has_no_stripes(grey(stage, 32, 2, "eevee"))
