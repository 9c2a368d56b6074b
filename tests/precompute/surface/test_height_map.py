# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from precompute.base.failure import GratingError
from precompute.surface.height_map import HeightMap, fill_missing, level_plane

PIXEL = (10e-9, 20e-9)


def height_map(height, **options):
    return HeightMap(np.asarray(height), PIXEL, "test", **options)


@st.composite
def holed(draw):
    """Heights of up to 12 x 12 pixels, and a mask of holes: at most half of the pixels, and no corner."""
    shape = draw(st.integers(1, 12)), draw(st.integers(1, 12))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    holes = np.zeros(shape, bool)
    count = draw(st.integers(0, holes.size // 2))
    holes.flat[rng.permutation(holes.size)[:count]] = True
    holes[[0, 0, -1, -1], [0, -1, 0, -1]] = False
    return rng.standard_normal(shape), holes


def test_keeps_heights_as_float64_that_nobody_changes():
    given_heights = np.arange(6, dtype=np.int16).reshape(2, 3)
    hm = height_map(given_heights)
    assert hm.height_m.dtype == np.float64
    assert (hm.rows, hm.cols) == (2, 3)
    assert hm.size_m == (2 * PIXEL[0], 3 * PIXEL[1])
    with pytest.raises(ValueError):
        hm.height_m[0, 0] = 1


@pytest.mark.parametrize(
    "height",
    [
        np.zeros(4),
        np.zeros((2, 2, 2)),
        np.zeros((0, 3)),
        np.full((2, 2), np.nan),
        [[0.0, np.inf]],
    ],
)
def test_refuses_heights_that_are_no_map(height):
    with pytest.raises(GratingError, match="^test: .*; "):
        height_map(height)


@pytest.mark.parametrize("pixel", [(0.0, 1e-9), (1e-9, -1e-9), (np.nan, 1e-9), (np.inf, 1e-9), (1e-9,)])
def test_refuses_pixel_sizes_that_are_no_lengths(pixel):
    with pytest.raises(GratingError, match="pixel size"):
        HeightMap(np.zeros((2, 2)), pixel, "test")


@given(holed(), st.floats(-5, 5), st.floats(-5, 5), st.floats(-1e3, 1e3))
def test_levelling_takes_any_plane_out(surface, slope_y, slope_x, offset):
    """Levelling h + plane gives the same as levelling h, and the result is orthogonal to every plane. Rounding: sums
    have 144 terms, and with half of the pixels the condition number is below 100. That is 144 x 100 x 2.2e-16 = 3e-12
    of the largest height, times 3 for the few sums."""
    height, holes = surface
    y, x = np.indices(height.shape)
    tilted = height + slope_y * y + slope_x * x + offset
    tolerance = 1e-11 * np.abs(tilted).max()
    height, tilted = (np.where(holes, np.nan, each) for each in (height, tilted))
    level = level_plane(height_map(tilted)).height_m
    assert np.array_equal(np.isnan(level), holes)
    np.testing.assert_allclose(level, level_plane(height_map(height)).height_m, rtol=0, atol=tolerance)
    for direction in (np.ones_like(x), y, x):
        assert abs(np.nansum(level * direction)) <= tolerance * np.sum(direction) + tolerance


def test_levelling_leaves_a_periodic_surface_its_slopes():
    ramp = np.tile(np.arange(8.0), (3, 2))
    level = level_plane(height_map(ramp, periodic=True)).height_m
    np.testing.assert_array_equal(level, ramp - 3.5)
    assert np.ptp(level_plane(height_map(ramp)).height_m) != pytest.approx(7)


@given(holed())
def test_filling_keeps_what_was_measured_and_invents_no_extremes(surface):
    height, holes = surface
    given_map = height_map(np.where(holes, np.nan, height))
    filled = fill_missing(given_map).height_m
    assert np.isfinite(filled).all()
    np.testing.assert_array_equal(filled[~holes], height[~holes])
    # Filled heights are means of means, so above the plane they lie between the measured extremes. With the corners
    # measured there is only one plane.
    plane = _continued(height - level_plane(given_map).height_m)
    measured = (height - plane)[~holes]
    assert (filled - plane).max() <= measured.max() + 1e-11
    assert (filled - plane).min() >= measured.min() - 1e-11


def _continued(plane):
    """The plane at all pixels, from the pixels where it is known."""
    y, x = np.indices(plane.shape)
    terms = np.stack([np.ones_like(x), y, x], axis=-1).astype(float)
    known = ~np.isnan(plane)
    return terms @ np.linalg.lstsq(terms[known], plane[known], rcond=None)[0]


@given(holed(), st.floats(-5, 5), st.floats(-5, 5))
def test_filling_continues_a_plane(surface, slope_y, slope_x):
    height, holes = surface
    y, x = np.indices(height.shape)
    plane = slope_y * y + slope_x * x
    filled = fill_missing(height_map(np.where(holes, np.nan, plane))).height_m
    np.testing.assert_allclose(filled, plane, rtol=0, atol=1e-11 * max(1.0, np.abs(plane).max()))


def test_filling_bridges_a_hole_without_a_step():
    """The surface x y is harmonic, so the ideal fill of a hole is x y itself, whose steps at this rim are 8. The
    relaxation ends after a few sweeps, so the test allows an error of half a step."""
    y, x = np.indices((32, 32)) - 15.5
    holes = np.zeros((32, 32), bool)
    holes[18:24, 18:24] = True
    filled = fill_missing(height_map(np.where(holes, np.nan, x * y))).height_m
    assert np.abs(filled - x * y).max() < 4


def test_filling_needs_nothing_but_one_pixel():
    height = np.full((7, 5), np.nan)
    height[3, 1] = 4.0
    np.testing.assert_array_equal(fill_missing(height_map(height)).height_m, 4.0)
