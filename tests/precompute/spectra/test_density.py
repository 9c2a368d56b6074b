# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums of a series' bins at scattered places against sums over every bin."""

import numpy as np
import pytest

from precompute.spectra.density import density_at
from precompute.spectra.series import SpectrumSeries
from precompute.spectra.spectrum import FrequencyGrid

# More wavelengths than are gathered at once.
LAMBDAS = np.geomspace(380e-9, 780e-9, 30)


def series_of(rows, columns, blur_q=0.0):
    """Bins 2e4 apart, with random light at five nodes."""
    rng = np.random.default_rng(0)
    q_y, q_x = ((np.arange(count) - (count - 1) / 2) * 2e4 for count in (rows, columns))
    grid = FrequencyGrid(q_y, q_x, (rows, columns))
    values = rng.random((5, rows, columns)).astype(np.float32)
    return SpectrumSeries(grid, 5.3e6, values, np.zeros(5, complex), blur_q)


def over_every_bin(series, u, v, *, w, sigma):
    """One wavelength after the other."""
    found = []
    for lam in LAMBDAS:
        left = series.kernel_left(sigma, lam)
        mix = series.weights(np.array(w / lam)) * (w / lam) ** 2
        down, across = (
            np.exp(-0.5 * ((at[:, None] - lam * q) / rest) ** 2) / (np.sqrt(2 * np.pi) * rest)
            for at, q, rest in zip((v, u), (series.grid.q_y, series.grid.q_x), left, strict=True)
        )
        found.append(np.einsum("k,kyx,ny,nx->n", mix, series.scattered_over_s2, down, across, optimize=True))
    return np.array(found)


@pytest.mark.parametrize("shape", [(90, 70), (1, 300), (200, 3)])
@pytest.mark.parametrize("blur_q", [0.0, 1.5e4])
def test_it_is_the_sum_over_every_bin(shape, blur_q):
    """At places on the bins, at their rim and far beyond it. The kernel is cut where it is 1.5e-8 of its peak, and the
    values have single precision: 1e-6 of the greatest."""
    series = series_of(*shape, blur_q)
    rng = np.random.default_rng(1)
    u, v = (rng.uniform(-1, 1, 40) * 1.5 * max(q[-1], 1e4) * 780e-9 for q in (series.grid.q_x, series.grid.q_y))
    expected = over_every_bin(series, u, v, w=1.3, sigma=0.02)
    found = density_at(series, u, v, w=1.3, lambdas=LAMBDAS, sigma=0.02)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * np.abs(expected).max())


def test_no_place_has_no_density():
    none = np.zeros(0)
    assert density_at(series_of(9, 9), none, none, w=1.0, lambdas=LAMBDAS, sigma=0.02).shape == (30, 0)
