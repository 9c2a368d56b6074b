# SPDX-License-Identifier: GPL-3.0-or-later
"""Blur and resampling of a spectrum's bins (precompute/spectra/series.py), as a bake uses them."""

import numpy as np
import pytest

from precompute.reference.reference import blurred, reference_grid
from precompute.spectra.series import Resampler
from precompute.spectra.spectrum import FrequencyGrid, frequency_grid, scattered_spectrum

from .conftest import waves


@pytest.mark.parametrize("lam", [400e-9, 720e-9])
def test_resampling_is_the_references_blur(lam):
    """Products with matrices, cut at 5.5 standard deviations, against the sum at every place, cut at 7. The part
    between is exp(-5.5^2 / 2) = 2.7e-7 of a bin's own peak, for each of the few bins there."""
    relief, sigma = waves(), 0.06
    grid = reference_grid(relief, sigma)
    power, _ = scattered_spectrum(relief, 1.5 / lam, grid)
    u, v = np.linspace(-1.9, 1.8, 150), np.linspace(-0.7, 1.1, 40)
    resample = Resampler(grid, u, v, lam, (sigma, sigma))
    image = resample(power[resample.kept])
    places = [c.ravel() for c in np.meshgrid(u, v)]
    expected = blurred(power, grid, places, lam=lam, sigma_b=sigma).reshape(40, 150)
    np.testing.assert_allclose(image, expected, rtol=0, atol=2e-6 * expected.max())


def test_resampling_meets_no_bins():
    relief = waves()
    grid = frequency_grid(relief, 1e6, 1e5)
    resample = Resampler(grid, np.linspace(1.8, 1.9, 5), np.linspace(1.8, 1.9, 4), 400e-9, (0.01, 0.01))
    power, _ = scattered_spectrum(relief, 1e6, grid)
    np.testing.assert_array_equal(resample(power[resample.kept]), np.zeros((4, 5)))


def test_no_resampled_impulse_is_subnormal():
    """Products with subnormal numbers take a hundred times as long on some processors. Eleven places lie within 5.5
    standard deviations of a single bin: 0.055 on either side, 0.01 apart."""
    grid = FrequencyGrid(np.array([0.0]), np.linspace(-2, 2, 401) / 500e-9, (1, 401))
    axis = np.linspace(-2, 2, 400)
    power = np.zeros((1, 401), np.float32)
    power[0, 200] = 1
    image = Resampler(grid, axis, np.zeros(1), 500e-9, (0.01, 0.01))(power)
    lit = image[image > 0]
    assert 10 <= len(lit) <= 12
    assert lit.min() > np.finfo(np.float32).tiny
