# SPDX-License-Identifier: GPL-3.0-or-later
"""How turning, shifting and scaling a height map change its spectrum."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.reference.reference import reference_xyz
from precompute.spectra.spectrum import FrequencyGrid, scattered_spectrum
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare

SIGMA_B = 0.05
PIXEL_M = 70e-9


def height_map(seed=0, rows=24, cols=30, pixel_m=(PIXEL_M, PIXEL_M), periodic=True):
    heights = 60e-9 * np.random.default_rng(seed).standard_normal((rows, cols))
    return HeightMap(heights, pixel_m, "test", periodic=periodic)


def changed(original, heights, pixel_m=None):
    return HeightMap(heights, pixel_m or original.pixel_size_m, "test", periodic=original.periodic)


def scattered(surface, u, v, w=1.3):
    """XYZ (n, 3) of the reference in steps of 40 nm; both sides of an equality are the same coarse sum."""
    return reference_xyz(prepare(surface), (np.asarray(u), np.asarray(v)), w=w, sigma_b=SIGMA_B, step_m=40e-9)[0]


def places(count=40):
    return np.random.default_rng(9).uniform(-1.2, 1.2, (2, count))


def agree(one, other):
    """Equal to ten digits of the brightest: the same 1e4 terms are summed in another order."""
    assert one.max() > 0
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-10 * one.max())


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 999), st.integers(0, 40), st.integers(0, 40))
def test_a_circular_shift_leaves_the_spectrum_alone(seed, down, right):
    surface = height_map(seed)
    shifted = changed(surface, np.roll(surface.height_m, (down, right), (0, 1)))
    agree(scattered(surface, *places()), scattered(shifted, *places()))


@pytest.mark.parametrize("periodic", [True, False])
def test_a_quarter_turn_turns_the_spectrum(periodic):
    """An anticlockwise turn of the scan as seen, from T to B, moves the light at (u, v) to (-v, u)."""
    surface = height_map(1, periodic=periodic)
    turned = changed(surface, np.rot90(surface.height_m))
    u, v = places()
    agree(scattered(surface, u, v), scattered(turned, -v, u))


@pytest.mark.parametrize("periodic", [True, False])
def test_transposing_mirrors_the_spectrum(periodic):
    """Rows run along -B and columns along T, so transposing moves the light at (u, v) to (-v, -u)."""
    surface = height_map(2, periodic=periodic)
    u, v = places()
    agree(scattered(surface, u, v), scattered(changed(surface, surface.height_m.T), -v, -u))


@pytest.mark.parametrize("factor", [0.5, 1.3])
def test_scaling_the_pixel_scales_the_frequencies(factor):
    """Each bin keeps its power, and its frequency is divided by the factor. All pixels are too small to be refined."""
    small = prepare(height_map(3))
    large = prepare(height_map(3, pixel_m=(factor * PIXEL_M, factor * PIXEL_M)))

    def spectrum(relief):
        q_y, q_x = (
            np.fft.fftshift(np.fft.fftfreq(n, d))
            for n, d in zip(relief.height_m.shape, relief.pixel_size_m, strict=True)
        )
        grid = FrequencyGrid(q_y, q_x, relief.height_m.shape)
        return grid, *scattered_spectrum(relief, 2e6, grid)

    (grid, power, zero), (wide_grid, wide_power, wide_zero) = spectrum(small), spectrum(large)
    np.testing.assert_allclose(wide_grid.q_x * factor, grid.q_x)
    np.testing.assert_allclose(wide_grid.q_y * factor, grid.q_y)
    np.testing.assert_array_equal(power, wide_power)
    assert zero == wide_zero


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 999), st.floats(1e5, 5.2e6), st.booleans())
def test_the_light_is_all_there(seed, s, periodic):
    """Parseval's theorem over the Nyquist cell, to 1e-12."""
    relief = prepare(height_map(seed, periodic=periodic))
    rows, cols = relief.height_m.shape
    q_y, q_x = (np.fft.fftshift(np.fft.fftfreq(n, d)) for n, d in zip((rows, cols), relief.pixel_size_m, strict=True))
    power, zero = scattered_spectrum(relief, s, FrequencyGrid(q_y, q_x, (rows, cols)))
    assert power.sum() + zero == pytest.approx(1, abs=1e-12)
