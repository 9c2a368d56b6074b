# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.surface.height_map import HeightMap
from precompute.surface.relief import PIXEL_MAX_M, prepare
from precompute.surface.samples.ruled_gratings import blazed

few = settings(deadline=None, max_examples=40)
FINE = (50e-9, 60e-9)
COARSE = (250e-9, 200e-9)


def height_map(along_b, pixel=FINE, periodic=False):
    """A height map from heights whose row index runs along +B, as in a Relief."""
    return HeightMap(np.asarray(along_b, float)[::-1], pixel, "test", periodic=periodic)


def rough(seed, shape=(24, 37), scale=100e-9):
    return scale * np.random.default_rng(seed).standard_normal(shape)


def plane(shape, slope_y, slope_x):
    y, x = np.indices(shape)
    return slope_y * y + slope_x * x


def middles(count, pixel):
    return (np.arange(count) + 0.5) * pixel


def test_rows_run_along_b():
    """Row 0 of a scan is its top, row 0 of a relief its bottom; columns keep their order."""
    scan = rough(0)
    relief = prepare(HeightMap(scan, FINE, "test", periodic=True))
    np.testing.assert_allclose(relief.height_m, scan[::-1] - scan.mean(), rtol=0, atol=1e-21)
    assert relief.pixel_size_m == pytest.approx(FINE, rel=1e-15)
    assert relief.size_m == pytest.approx((24 * 50e-9, 37 * 60e-9), rel=1e-14)


def test_a_facet_that_rises_along_b_rises_with_the_rows():
    facets = blazed(periods=2).height_m[:64, :64]
    # A scan of a surface that rises along +B has its highest row at the top of each facet.
    relief = prepare(HeightMap(facets.T[::-1], FINE, "test", periodic=True))
    assert (np.diff(relief.height_m, axis=0)[:31] > 0).all()


@few
@given(st.integers(0, 2**32), st.floats(-1e-7, 1e-7), st.floats(-1e-7, 1e-7), st.floats(-1e-3, 1e-3))
def test_tilt_and_offset_of_a_scan_do_not_count(seed, slope_y, slope_x, offset):
    """Rounding: an offset of 1 mm is kept to 2e-19 m; a sum has 900 pixels, and the condition number is below 100."""
    heights = rough(seed)
    tilted = heights + plane(heights.shape, slope_y, slope_x) + offset
    one, other = (prepare(height_map(h)).height_m for h in (heights, tilted))
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-15)


def test_a_surface_that_wraps_keeps_its_facets():
    """A plane fitted to facets would remove a part of their slope."""
    facets = blazed(rows=4, periods=3)
    relief = prepare(facets)
    np.testing.assert_allclose(np.diff(relief.height_m[:, :32]), 246.23e-9 / 32, rtol=1e-9)


@few
@given(st.integers(0, 2**32), st.booleans(), st.sampled_from([FINE, COARSE]))
def test_the_mean_weighted_by_the_squared_apodisation_is_zero(seed, periodic, pixel):
    """To the rounding of up to 5000 terms of 1e-7 m."""
    relief = prepare(height_map(rough(seed), pixel, periodic))
    assert abs(np.average(relief.height_m, weights=relief.apodisation**2)) < 1e-20


def test_a_surface_that_wraps_is_not_apodised():
    np.testing.assert_array_equal(prepare(height_map(rough(0), periodic=True)).apodisation, 1)


@pytest.mark.parametrize("shape", [(64, 64), (65, 200), (16, 1), (1, 40)])
def test_the_apodisation_rises_over_a_fifth_at_each_end(shape):
    """It is separable and symmetric, 1 over the middle three fifths, and 0.5 at a tenth from each end."""
    apodisation = prepare(height_map(rough(0, shape))).apodisation
    rows, cols = shape
    down, across = apodisation[:, cols // 2], apodisation[rows // 2]
    np.testing.assert_allclose(apodisation, np.outer(down, across), atol=1e-15)
    for profile in (down, across):
        np.testing.assert_allclose(profile, profile[::-1], atol=1e-15)
        count = len(profile)
        if count == 1:
            assert profile == 1
            continue
        x = (np.arange(count) + 0.5) / count
        np.testing.assert_array_equal(profile[(x >= 1 / 5) & (x <= 4 / 5)], 1)
        assert (np.diff(profile[x < 1 / 5]) > 0).all()
        # Linear interpolation between samples at a distance h has an error of h^2 / 8 of the curvature. The curvature
        # is at most (5 pi)^2 / 2, and 0 at the half way point, which halves the error.
        assert np.interp(1 / 10, x, profile) == pytest.approx(0.5, abs=(5 * np.pi / count) ** 2 / 32)
        # The integral of the square is 3/5 for the flat part and 3/8 of a fifth for each end; sums have an error of
        # 1 / count^2.
        assert np.mean(profile**2) == pytest.approx(3 / 4, abs=1 / count**2)


def band_limited(y, x, size):
    """A sum of waves that wrap, with at most 3 periods along each side and no symmetry."""
    waves = [(1, 0, 40e-9, 0.3), (0, 1, 60e-9, 1.1), (2, -1, 25e-9, 2.0), (-1, 3, 15e-9, 0.7), (3, 2, 10e-9, 5.0)]
    cycles = [(m * y[:, None] / size[0] + n * x[None, :] / size[1], a, c) for m, n, a, c in waves]
    return sum(a * np.cos(2 * np.pi * cycle + c) for cycle, a, c in cycles)


@pytest.mark.parametrize("shape", [(16, 20), (15, 21), (9, 7)])
def test_refining_a_surface_that_wraps_is_exact(shape):
    """Fourier interpolation of a band-limited surface is exact, to a hundred roundings of 1.5e-7 m. Pixels are cells:
    fine cells divide the coarse ones, and have other centres."""
    size = tuple(n * d for n, d in zip(shape, COARSE, strict=True))
    coarse = band_limited(*(middles(n, d) for n, d in zip(shape, COARSE, strict=True)), size)
    relief = prepare(height_map(coarse, COARSE, periodic=True))
    # Pixels of 250 and 200 nm are divided into pieces of at most 95 nm.
    fine = tuple(3 * n for n in shape)
    assert relief.height_m.shape == fine
    assert relief.size_m == pytest.approx(size, rel=1e-14)
    exact = band_limited(*(middles(n, length / n) for n, length in zip(fine, size, strict=True)), size)
    np.testing.assert_allclose(relief.height_m, exact - exact.mean(), rtol=0, atol=2e-20)


def test_refining_the_highest_wave_keeps_its_power_on_one_axis():
    """Heights that alternate from pixel to pixel are a wave at the Nyquist frequency, sampled at its crests and
    troughs. The refined wave must not swing further."""
    zigzag = np.tile([50e-9, -50e-9], (4, 8))
    relief = prepare(height_map(zigzag, (80e-9, 190e-9), periodic=True))
    x = middles(32, 95e-9)
    # The old samples are the extremes of this wave.
    exact = 50e-9 * np.sin(np.pi * x / 190e-9)
    np.testing.assert_allclose(relief.height_m, np.tile(exact, (4, 1)), atol=1e-20)


def test_pixels_of_a_quarter_of_violet_are_fine_enough():
    heights = rough(0, (8, 8))
    assert prepare(height_map(heights, (PIXEL_MAX_M, PIXEL_MAX_M))).height_m.shape == (8, 8)
    assert prepare(height_map(heights, (PIXEL_MAX_M * 1.01, PIXEL_MAX_M))).height_m.shape == (16, 8)


@few
@given(st.floats(10e-9, 900e-9), st.floats(10e-9, 900e-9), st.booleans())
def test_no_pixel_aliases_and_the_size_stays(dy, dx, periodic):
    relief = prepare(height_map(rough(0, (6, 9)), (dy, dx), periodic))
    assert max(relief.pixel_size_m) <= PIXEL_MAX_M * (1 + 1e-8)
    assert relief.size_m == pytest.approx((6 * dy, 9 * dx), rel=1e-12)
    assert relief.height_m.shape == relief.apodisation.shape
    for fine, coarse, pixel in zip(relief.height_m.shape, (6, 9), (dy, dx), strict=True):
        assert fine == coarse * max(1, round(np.ceil(pixel / PIXEL_MAX_M - 1e-9)))


def test_refining_a_scan_that_does_not_wrap():
    """A bump of 2 um half-width, cut by the edges, on pixels of 250 nm and 200 nm. At an edge the bump meets its mirror
    image in a corner, as its slope of at most 150 nm / 2 um changes sign there. Pixels of 250 nm round off the corner
    by at most slope * pixel / 4 = 5 nm. Three pixels further in, the ripple has fallen to a tenth of that."""
    shape = (40, 50)
    size = 10e-6

    def bump(y, x):
        return 150e-9 * np.exp(-((y[:, None] - 2.5e-6) ** 2 + (x - 6e-6) ** 2) / (2 * (2e-6) ** 2))

    coarse = bump(middles(40, 250e-9), middles(50, 200e-9))
    relief = prepare(height_map(coarse, COARSE))
    fine = tuple(3 * n for n in shape)
    exact = bump(*(middles(n, size / n) for n in fine))
    # Levelling and the mean under the apodisation are those of the exact surface.
    expected = prepare(height_map(exact, tuple(size / n for n in fine))).height_m
    error = np.abs(relief.height_m - expected)
    assert error.max() < 5e-9
    assert error[9:-9, 9:-9].max() < 0.5e-9
    assert relief.height_range_m == pytest.approx(np.ptp(expected), rel=0.02)


@few
@given(st.integers(0, 2**32))
def test_holes_are_filled_within_the_measured_heights(seed):
    """Measured pixels keep their heights, apart from one common offset."""
    heights = rough(seed, (12, 15))
    holes = np.random.default_rng(seed).random(heights.shape) < 0.2
    holes[[0, 0, -1, -1], [0, -1, 0, -1]] = False
    # A periodic surface is not levelled, so only an offset is subtracted.
    relief = prepare(height_map(np.where(holes, np.nan, heights), periodic=True))
    assert np.isfinite(relief.height_m).all()
    np.testing.assert_allclose(np.ptp((relief.height_m - heights)[~holes]), 0, atol=1e-20)


def test_holes_of_a_plane_leave_a_mirror():
    flat = plane((20, 20), 3e-9, -5e-9)
    flat[4:9, 6:12] = np.nan
    np.testing.assert_allclose(prepare(height_map(flat)).height_m, 0, atol=1e-20)


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("shape", [(1, 40), (40, 1), (1, 1), (2, 2)])
def test_a_thin_scan_is_prepared(shape, periodic):
    relief = prepare(height_map(rough(1, shape), COARSE, periodic))
    assert np.isfinite(relief.height_m).all()
    assert relief.size_m == pytest.approx(tuple(n * d for n, d in zip(shape, COARSE, strict=True)), rel=1e-14)
    assert relief.apodisation.max() == pytest.approx(1)


def test_the_range_is_from_the_lowest_to_the_highest():
    heights = rough(3)
    assert prepare(height_map(heights, periodic=True)).height_range_m == pytest.approx(np.ptp(heights), rel=1e-12)
