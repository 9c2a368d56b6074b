# SPDX-License-Identifier: GPL-3.0-or-later
"""Planes and polynomials, with and without dust."""

import numpy as np
import pytest
from numpy.polynomial import polynomial

from .conftest import wave

Y, X = np.indices((128, 128)) / 127 * 2 - 1


def test_a_robust_plane_does_not_see_dust(levelled):
    """Dust 400 nm high on 2 % of the scan, all in one corner, tilts a least-squares plane. The wave's own slope is the
    same in both fits, so the remaining tilt is the dust's."""
    clean = wave(angle_deg=30, amplitude=20e-9)
    dusty = clean + 40e-9 * X - 10e-9 * Y
    dusty[:18, :18] += 400e-9
    away = np.ones((128, 128), bool)
    away[:18, :18] = False
    exact, _, _ = levelled(np.where(away, clean, np.nan), "plane")
    robust, _, _ = levelled(dusty, "plane:robust")
    fitted, _, _ = levelled(dusty, "plane")
    # A wave's trough leaves at most a few pixels of the dust's edge within three deviations.
    assert np.abs((robust - exact)[away]).max() < 0.1e-9
    assert np.abs((fitted - exact)[away]).max() > 20e-9


@pytest.mark.parametrize("height", [np.zeros((16, 16)), np.eye(16) * 1e-9, X * 1e-7])
def test_a_robust_plane_where_most_heights_lie_in_one(levelled, height):
    """Either nothing counts as dust, or everything except the plane; both leave heights."""
    level, _, _ = levelled(height, "plane:robust")
    assert np.isfinite(level).all() and np.ptp(level) <= np.ptp(height) + 1e-20


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_a_polynomial_of_its_degree_is_taken_out(levelled, degree):
    """Every power of x and y up to the total degree, and a hole; one degree more leaves a rest."""
    rng = np.random.default_rng(degree)
    powers = np.add.outer(np.arange(6), np.arange(6))
    factors = np.where(powers <= degree, rng.normal(0, 1e-7, (6, 6)), 0)
    height = polynomial.polyval2d(Y, X, factors)
    height[20:60, 90:] = np.nan
    level, _, _ = levelled(height, f"poly:{degree}")
    # Powers of numbers up to 1 and 21 coefficients of 1e-7, in doubles: 1e-16 of that, times the equations' condition
    # number.
    assert np.nanmax(np.abs(level)) < 1e-18
    assert np.isnan(level).sum() == np.isnan(height).sum()
    if degree < 5:
        more, _, _ = levelled(height + 1e-7 * X ** (degree + 1), f"poly:{degree}")
        assert np.nanmax(np.abs(more)) > 1e-9


def test_a_polynomial_leaves_a_grating(levelled):
    level, _, told = levelled(wave() + 300e-9 * X**2, "poly")
    assert told == ()
    assert np.std(level) == pytest.approx(50e-9 / np.sqrt(2), rel=0.02)
