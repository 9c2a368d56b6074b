# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.world_sources.sources import (
    WIDEST,
    Source,
    crop_cells,
    crop_frame,
    fit_sources,
    light_of_rest,
    lit,
    missed,
    owners,
    panorama_cells,
    refit,
)
from tests.precompute.world_sources.worlds import COLS, ROWS, angles_deg, box, direction, disc, picture, sky

CELLS = panorama_cells(ROWS, COLS)
PIXEL_DEG = 180 / ROWS


def off_deg(source, towards):
    return np.degrees(np.arccos(np.clip(source.direction @ towards, -1, 1)))


@pytest.mark.parametrize("towards", [(40, 10), (-15, 179), (89, 0), (3, -60)])
def test_a_sun_of_few_pixels(towards):
    """A sun of 0.53 degrees in a pixel of 1.4 degrees: the source has its light and the pixel's place and width."""
    sun = direction(*towards)
    light = np.where(np.arange(len(CELLS.directions)) == np.argmax(CELLS.directions @ sun), 20000.0, 0)
    [source] = fit_sources(picture(sky() + light), 8)
    pixel = np.argmax(light)
    assert off_deg(source, CELLS.moments[pixel] / np.linalg.norm(CELLS.moments[pixel])) < 0.01
    expected = picture(sky() + light).reshape(-1, 3)[pixel] * CELLS.solid_angles[pixel]
    # The cone of 1 square degree also holds some sky: at a pole, that of 43 thin pixels and what its edge cuts.
    np.testing.assert_allclose(source.irradiance, expected, rtol=60 / 20000)
    assert source.variance <= np.radians(PIXEL_DEG) ** 2 / 12 * 1.01


def test_two_soft_boxes_over_a_sky():
    near, far = direction(50, 30), direction(35, 150)
    world = picture(sky() + 20 * disc(near, 4) + 20 * disc(far, 7))
    wide, small = fit_sources(world, 2)
    for source, towards, radius in ((small, near, 4), (wide, far, 7)):
        assert off_deg(source, towards) < 0.1 * PIXEL_DEG
        # r^2 / 4, and at most a third of a pixel for the soft edge.
        assert 2 * np.degrees(np.sqrt(source.variance)) == pytest.approx(radius, abs=PIXEL_DEG / 3)
        inside = angles_deg(towards) < np.degrees(source.cone_radius)
        np.testing.assert_allclose(
            source.irradiance, (world.reshape(-1, 3) * CELLS.solid_angles[:, None])[inside].sum(axis=0), rtol=0.02
        )
    assert missed(world, [wide, small]) < 1e-3
    # The small box exceeds the sky by its own light, 20.
    share = 20 * disc(near, 4) @ CELLS.solid_angles / (world.mean(axis=2).reshape(-1) @ CELLS.solid_angles)
    assert missed(world, [wide]) == pytest.approx(share, rel=0.02)


def test_a_window_is_divided_as_far_as_sources_go():
    """A quarter of the window is narrow enough for a source."""
    window = box(direction(20, 70), 16, 24)
    world = picture(0.2 + 5 * window)
    inside = window > 0
    variance_of_quarters = None
    assert fit_sources(world, 3) == []
    for count, radius_deg in ((4, np.hypot(8, 12) / 2), (8, np.hypot(8, 6) / 2)):
        sources = fit_sources(world, count)
        assert len(sources) == count
        # Cones reach the corners of the rectangles that divide the window, to a pixel, times sqrt(1.4) for the variance
        # that a divided source gains.
        assert max(np.degrees(s.cone_radius) for s in sources) < np.sqrt(1.4) * radius_deg + PIXEL_DEG / 2
        # Only the window's edge, a pixel or two wide, may lie outside.
        assert (owners(sources, CELLS.directions)[inside] >= 0).mean() > 0.97
        light = sum(s.irradiance[1] * s.variance for s in sources)
        assert variance_of_quarters is None or light < variance_of_quarters
        variance_of_quarters = light


def test_a_divided_light_is_one_even_light():
    """The Gaussians that divide a wide box form one even light: their sum has no dip along the line through the box's
    middle. Its variance is the box's."""
    middle = direction(20, 70)
    sources = fit_sources(picture(0.2 + 20 * box(middle, 20, 20)), 4)
    assert len(sources) == 4
    x, y, z = np.array([crop_frame(middle).T @ source.direction for source in sources]).T
    light, variance = (np.array([getattr(source, name) for source in sources]) for name in ("irradiance", "variance"))
    light = light[:, 1] / light[:, 1].sum()
    along = np.linspace(-np.radians(10), np.radians(10), 81)
    for place in (y, z):
        profile = light / np.sqrt(variance) @ np.exp(-((along - place[:, None]) ** 2) / 2 / variance[:, None])
        within = profile[np.abs(along) < np.abs(place).max()]
        # Two Gaussians with a deviation of 0.37 of their distance: the sum at their middle is 2
        # exp(-1 / 8 / 0.37^2) = 0.80, at the axes 1.03. With 0.29, the deviation of squares, it would be 0.45.
        assert within.min() > 0.76 * within.max()
    whole = light @ (variance + (y**2 + z**2 - (light @ y) ** 2 - (light @ z) ** 2) / 2)
    assert whole == pytest.approx(np.radians(20) ** 2 / 12, rel=0.05)


def test_two_windows_and_the_bright_wall_between_them():
    """The wall joins both windows into one part, whose middle lies in neither window."""
    left, right = direction(10, -7), direction(10, 7)
    world = picture(0.1 + 8 * box(left, 8, 8) + 7 * box(right, 8, 8) + 4.5 * box(direction(10, 0), 7, 8))
    sources = fit_sources(world, 2)
    assert len(sources) == 2
    for source, towards in zip(sources, (left, right), strict=True):
        # Two halves of 8 x 11 degrees, with their middles drawn 6 degrees from the common middle by the wall's light,
        # have a variance of (8^2 + 11^2) / 24 = 7.7, of which they gain 0.4, and 6^2 / 2 = 18 between them. So they
        # come nearer by 1 - sqrt(1 - 0.4 x 7.7 / 18) = 0.09 of the 6 degrees.
        assert off_deg(source, towards) < PIXEL_DEG + 0.09 * 6
        assert np.degrees(source.cone_radius) < 8 * np.sqrt(1.4)


@pytest.mark.night("test_a_sun_and_the_glow_around_it_are_two_sources")
def test_a_window_that_takes_more_sources_than_there_are_is_none_of_them():
    """Random samples of a window are exact; half of it as a source would be a streak. A sun beside it is a source."""
    window = 5 * box(direction(10, 70), 36, 44)
    assert fit_sources(picture(0.2 + window), 8) == []
    assert missed(picture(0.2 + window), []) == pytest.approx(0.48, rel=0.1)
    sources = fit_sources(picture(0.2 + window), 16)
    assert len(sources) == 16 and missed(picture(0.2 + window), sources) < 0.02
    [sun] = fit_sources(picture(0.2 + window + 500 * disc(direction(40, -60), 1.5)), 8)
    assert off_deg(sun, direction(40, -60)) < 0.1


def test_a_sun_and_the_glow_around_it_are_two_sources():
    sun = direction(40, 10)
    glow = 30 * np.exp(-angles_deg(sun) / 6)
    world = picture(sky() + 20000 * disc(sun, 1.5) + glow)
    source, *behind = fit_sources(world, 8)
    assert off_deg(source, sun) < 0.1
    assert all(4 < np.degrees(piece.cone_radius) < 15 and off_deg(piece, sun) < 6 for piece in behind)
    # 1.22 radii of the disc with its soft edge.
    assert np.degrees(source.cone_radius) < 1.22 * (1.5 + PIXEL_DEG / 2)
    # The glow above its own level at 28 degrees: an even disc of that width has the variance of the widest part, with a
    # cone of 0.6 rad. The sky behind is not quite even.
    edge = np.degrees(np.arccos(1 - 2 * (1 - np.cos(0.6)) / 3))
    inside = (angles_deg(sun) > np.degrees(source.cone_radius) + PIXEL_DEG / 2) & (angles_deg(sun) < edge)
    light = ((glow - 30 * np.exp(-edge / 6)) * CELLS.solid_angles)[inside].sum()
    share = light / (world.mean(axis=2).reshape(-1) @ CELLS.solid_angles)
    assert missed(world, [source]) == pytest.approx(share, rel=0.1)
    assert missed(world, [source, *behind]) < 0.4 * share


def test_a_gaussian_lamp_has_most_of_its_light_in_its_cone():
    """For a Gaussian of variance s^2, the cone that matches its own light ends at 0.7 s^2 x 3 and holds 0.88."""
    lamp = direction(40, 10)
    light = np.exp(-(np.radians(angles_deg(lamp)) ** 2) / 2 / 0.04**2)
    [source] = fit_sources(picture(0.001 + light), 1)
    assert 0.6 * 0.04**2 < source.variance < 0.8 * 0.04**2
    assert 0.83 < source.irradiance[1] / (light @ CELLS.solid_angles) < 0.92


@pytest.mark.short("uniform", "a light too wide")
@pytest.mark.parametrize("luminance", [
    np.ones(ROWS * COLS), np.zeros(ROWS * COLS), sky(), 0.1 + disc(direction(40, 10), 30),
    np.where(CELLS.directions[:, 2] > 0, 1 + 2 * CELLS.directions[:, 2], 0.2),
], ids=["uniform", "black", "gradient", "a light too wide", "overcast (CIE)"])  # fmt: skip
def test_worlds_without_a_compact_part(luminance):
    assert fit_sources(picture(luminance), 8) == []
    assert missed(picture(luminance), []) == 0


def test_many_small_lamps_are_missed_where_none_is_worth_a_source():
    luminance = np.full((ROWS, COLS), 1e-6)
    luminance[20:100:8, 0:240:12] = 1.0
    luminance /= np.cos(np.radians((np.arange(ROWS) + 0.5) * PIXEL_DEG - 90))[:, None]
    assert fit_sources(picture(luminance.reshape(-1)), 8) == []
    assert missed(picture(luminance.reshape(-1)), []) > 0.99


def test_of_forty_windows_the_brightest_are_sources_and_no_light_is_lost():
    """Four rows of ten windows. A source has all the light of its window, and the rest is that of the others."""
    places = [direction(up, 36 * column + 18 * row) for row, up in enumerate((10, 28, 46, 64)) for column in range(10)]
    strength = np.random.default_rng(5).permutation(np.linspace(2, 8, 40))
    windows = [shine * box(at, 8, 6) for shine, at in zip(strength, places, strict=True)]
    world = picture(0.1 + sum(windows))
    sources = fit_sources(world, 8)
    assert len(sources) == 8
    light = world.reshape(-1, 3) * CELLS.solid_angles[:, None]
    owner = owners(sources, CELLS.directions)
    np.testing.assert_allclose(sum(s.irradiance for s in sources) + light[owner < 0].sum(axis=0), light.sum(axis=0))
    for source in sources:
        nearest = int(np.argmax(places @ source.direction))
        # The cone of 5.1 degrees holds 0.025 sr of the wall, and all of the window but a pixel at each corner.
        own = windows[nearest] @ CELLS.solid_angles
        assert source.irradiance[1] == pytest.approx(own + 0.1 * np.pi * np.radians(5.1) ** 2, rel=0.02)
    # The windows are near in light, so the densest need not be the brightest; none is far from them.
    found = sorted(strength[int(np.argmax(places @ source.direction))] for source in sources)
    assert found[0] > 5
    bright = np.array(windows).sum(axis=0) @ CELLS.solid_angles
    inside = sum(windows[int(np.argmax(places @ s.direction))] for s in sources) @ CELLS.solid_angles
    all_light = world.mean(axis=2).reshape(-1) @ CELLS.solid_angles
    assert missed(world, sources) == pytest.approx((bright - inside) / all_light, abs=0.02)


def test_bad_pixels_count_as_black():
    world = picture(sky() + 20 * disc(direction(50, 30), 5))
    clean, spoilt = world.copy(), world.copy()
    clean[5, 7], clean[90, 100], clean[3, 200] = 0, 0, 0
    spoilt[5, 7], spoilt[90, 100], spoilt[3, 200] = np.nan, np.inf, -5
    for one, other in zip(fit_sources(clean, 8), fit_sources(spoilt, 8), strict=True):
        np.testing.assert_array_equal(one.direction, other.direction)
        np.testing.assert_array_equal(one.irradiance, other.irradiance)
    assert missed(spoilt, []) == missed(clean, [])


@pytest.mark.parametrize("shape", [(1, 16), (1, 1), (2, 3)])
def test_pictures_too_coarse_to_hold_anything_compact(shape):
    world = np.zeros((*shape, 3))
    world[0, 0] = 1
    assert fit_sources(world, 4) == []
    assert 0 <= missed(world, []) <= 1


def test_no_sources_are_asked_for():
    assert fit_sources(picture(sky() + 20 * disc(direction(50, 30), 5)), 0) == []


def test_refit_on_finer_cells_finds_the_sun_itself():
    """A sun of 0.53 degrees, 0.3 degrees beside the middle of cells of 0.05 degrees."""
    towards, radius = direction(40, 10), np.radians(0.265)
    begin = Source(direction(40.3, 10), np.zeros(3), np.radians(0.8) ** 2 / 3)
    cells = crop_cells(64, np.radians(1.6), begin.direction)
    angle = np.arccos(np.clip(cells.directions @ towards, -1, 1))
    disc_light = np.clip((radius - angle) / np.radians(0.05) + 0.5, 0, 1)
    source = refit(begin, (3 + 1e5 * disc_light)[:, None] * (1, 2, 3), cells)
    assert off_deg(source, towards) < 0.005
    # pi r^2 of the disc, and almost nothing of the sky. Its edge of 0.05 degrees adds (0.05/0.265)^2/12 to its area.
    np.testing.assert_allclose(source.irradiance, 1e5 * np.pi * radius**2 * np.array((1, 2, 3)), rtol=0.01)
    # The edge adds 5/12 of (0.05/0.265)^2 to the variance, the cells 4/12 of it.
    assert source.variance == pytest.approx(radius**2 / 4, rel=0.03)


def test_cones_that_overlap_share_by_the_nearest_axis():
    one, other = (Source(direction(0, azimuth), np.zeros(3), 0.01) for azimuth in (0, 12))
    asked = np.array([direction(0, azimuth) for azimuth in (-12, 5, 7, 20, 30)])
    assert owners([one, other], asked).tolist() == [-1 + 1, 0, 1, 1, -1]
    assert owners([], asked).tolist() == [-1] * 5


lights = st.lists(
    st.tuples(st.floats(-80, 80), st.floats(-180, 180), st.floats(2, 12), st.floats(1, 50)), min_size=1, max_size=4
)


def world_of(given_lights):
    return picture(sky() + sum(strength * disc(direction(up, around), r) for up, around, r, strength in given_lights))


@settings(max_examples=4, deadline=None)
@given(lights)
def test_sources_and_rest_are_all_the_light(given_lights):
    world = world_of(given_lights)
    sources = fit_sources(world, 8)
    light = world.reshape(-1, 3) * CELLS.solid_angles[:, None]
    rest = light[owners(sources, CELLS.directions) < 0].sum(axis=0)
    total = sum((source.irradiance for source in sources), rest)
    np.testing.assert_allclose(total, light.sum(axis=0), rtol=1e-12)
    # A divided source gains up to 0.4 of its variance.
    assert all(source.variance <= 1.4 * (1 - np.cos(WIDEST)) / 3 for source in sources)
    assert len(sources) <= 8
    assert [s.irradiance.sum() for s in sources] == sorted((s.irradiance.sum() for s in sources), reverse=True)


@settings(max_examples=3, deadline=None)
@given(lights, st.integers(1, COLS - 1))
def test_a_world_turned_about_z_has_its_sources_turned(given_lights, columns):
    world = world_of(given_lights)
    angle = -2 * np.pi * columns / COLS  # columns run clockwise, seen from above
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    sources, turned = fit_sources(world, 3), fit_sources(np.roll(world, columns, axis=1), 3)
    assert len(sources) == len(turned)
    for one in sources:
        # Both halves of a light have the same light, so rounding decides their order.
        other = max(turned, key=lambda each, one=one: each.direction @ turn @ one.direction)
        np.testing.assert_allclose(turn @ one.direction, other.direction, atol=1e-8)
        np.testing.assert_allclose(one.irradiance, other.irradiance, rtol=1e-8)
        assert one.variance == pytest.approx(other.variance, rel=1e-8)


@pytest.mark.night("test_a_window_is_divided_as_far_as_sources_go")
@settings(max_examples=3, deadline=None)
@given(lights, st.integers(-20, 20))
def test_a_brighter_world_has_brighter_sources_and_nothing_else(given_lights, stops):
    world = world_of(given_lights)
    for one, other in zip(fit_sources(world, 4), fit_sources(world * 2.0**stops, 4), strict=True):
        np.testing.assert_array_equal(one.direction, other.direction)
        np.testing.assert_array_equal(one.irradiance * 2.0**stops, other.irradiance)
        assert one.variance == other.variance


def test_of_a_sun_before_the_middle_of_a_cloud_the_sun_has_its_own_light():
    towards = direction(40, 10)
    sun, cloud = Source(towards, np.zeros(3), 1e-5), Source(towards, np.zeros(3), 1e-2)
    assert owners([cloud, sun], np.array([direction(40.2, 10), direction(41, 10)])).tolist() == [1, 0]


def test_lit_gives_the_light_of_other_cells():
    source = Source(direction(40, 10), np.zeros(3), 0.001)
    [again] = lit([source], np.ones((len(CELLS.directions), 3)), CELLS)
    # 2 pi (1 - cosine) of a cone of 3.1 degrees, to the pixels that its edge cuts: 15 pixels in all.
    assert again.irradiance[0] == pytest.approx(2 * np.pi * 0.003, rel=0.15)


def test_the_rest_of_a_world_is_the_light_in_no_source():
    radiance = np.ones((32, 64, 3)) * (1.0, 2.0, 3.0)
    whole = 4 * np.pi * np.array([1.0, 2.0, 3.0])
    np.testing.assert_allclose(light_of_rest(radiance, []), whole, rtol=1e-12)
    source = Source(np.array([0.0, 0.0, 1.0]), np.ones(3), 0.05)
    (taken,) = lit([source], radiance.reshape(-1, 3), panorama_cells(32, 64))
    np.testing.assert_allclose(light_of_rest(radiance, [source]) + taken.irradiance, whole, rtol=1e-12)
