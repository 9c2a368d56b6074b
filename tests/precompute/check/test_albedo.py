# SPDX-License-Identifier: GPL-3.0-or-later
"""The albedo bound of `check` against the bake's, which shares no code with it."""

import numpy as np
import pytest

from precompute.bake.excess_albedo import excess_at
from precompute.check.albedo import _counted, albedo_bound, spectrum_of
from precompute.colour.observer import WAVELENGTH_MIN_M
from precompute.measure.errors import DELTA_E_OF_BOUND
from precompute.reference.ensemble_reference import reference_grid
from precompute.spectra.series import spectrum_series
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed, flat

SIGMA_B = 0.03


def skin():
    rng = np.random.default_rng(3)
    y, x = (np.arange(n) / n for n in (64, 80))
    phase = 0.8 * np.cos(2 * np.pi * (x + y[:, None])) + 0.5 * np.cos(2 * np.pi * (2 * x - y[:, None]) + 1)
    heights = 110e-9 * np.sin(2 * np.pi * 4 * x + phase) + 30e-9 * rng.standard_normal((64, 80)).cumsum(axis=0) / 7
    return prepare(HeightMap(heights, (70e-9, 70e-9), "test"))


def directions(count=40):
    """Directions that are mostly near the horizon, where there is an excess."""
    rng = np.random.default_rng(1)
    cosine, turn = rng.uniform(0.05, 0.7, count), rng.uniform(0, 2 * np.pi, count)
    return np.column_stack([*(np.sqrt(1 - cosine**2) * [np.cos(turn), np.sin(turn)]), cosine])


@pytest.mark.parametrize("sigma_b", [0.0075, SIGMA_B])
@pytest.mark.parametrize("relief", [skin(), prepare(blazed(periods=4, rows=1))])
def test_it_is_the_bound_that_the_bake_measures_itself_against(relief, sigma_b):
    """The two quadratures are independent. The default budget is a dE00 of 1: their difference is always below it, and
    at most a quarter of it at nine in ten of these directions."""
    series = spectrum_series(relief, reference_grid(relief, sigma_b), 2 / WAVELENGTH_MIN_M, tolerance=1e-6)
    wi = directions()
    expected = 1 + np.maximum(excess_at([series], sigma_b, wi.reshape(5, 8, 3)).ravel() / wi[:, 2], 0)
    found = albedo_bound([spectrum_of(relief, sigma_b)], wi, sigma_b=sigma_b)
    delta_e = DELTA_E_OF_BOUND * np.abs(found / expected - 1)
    assert expected.max() > 1.2
    assert np.percentile(delta_e, 90) < 0.25 and delta_e.max() < 1


def test_a_mirror_has_no_excess():
    """It reflects all light that its kernel keeps above the horizon. The kernel's sum is exact to 2e-4."""
    assert albedo_bound([spectrum_of(prepare(flat()), SIGMA_B)], directions(), sigma_b=SIGMA_B).max() < 1 + 2e-4


def test_cells_are_counted_into_blocks():
    values = np.arange(12.0).reshape(1, 2, 6)
    index = np.array([-1, 0, 0, 2, 2, 3])
    np.testing.assert_array_equal(_counted(values, index, 3, 2), [[[3, 0, 7], [15, 0, 19]]])
