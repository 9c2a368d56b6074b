# SPDX-License-Identifier: GPL-3.0-or-later
"""Wavelengths drawn in proportion to the observer's sensitivity."""

from functools import partial

import numpy as np
import pytest

from precompute.colour.illuminants import ILLUMINANTS
from precompute.colour.observer import drawn_weight, observer, wavelength_quantiles, white_xyz
from tests.precompute.chi_square import LIMIT, unlikeliness

EACH = pytest.mark.parametrize("illuminant", ILLUMINANTS)
# The observer's table is linear between its rows, which are 1 nm apart.
ROWS = np.arange(380, 781) * 1e-9
STEP = 1e-9
# The module takes the density as constant within its own steps, a tenth of these.
OWN_STEP = 0.1e-9


def density(wavelengths, illuminant):
    """X + Y + Z of the observer."""
    return observer(wavelengths, illuminant).sum(axis=1)


def share_below(wavelengths, illuminant):
    """The exact share of the density's integral below wavelengths (n,)."""
    rows = density(ROWS, illuminant)
    before = np.concatenate([[0], np.cumsum((rows[1:] + rows[:-1]) / 2 * STEP)])
    row = np.minimum(((wavelengths - ROWS[0]) / STEP).astype(int), len(ROWS) - 2)
    part = (wavelengths - ROWS[row]) * (rows[row] + density(wavelengths, illuminant)) / 2
    return (before[row] + part) / before[-1]


@EACH
@pytest.mark.parametrize("count", [1, 16, 512])
def test_each_stands_for_an_equal_share(count, illuminant):
    """Each draw is the middle of one of n equal shares. A share that is linear between the module's steps has an error
    of the density's slope times the step squared, over 8."""
    found = wavelength_quantiles(count, illuminant)
    assert (np.diff(found) > 0).all()
    slope = np.abs(np.diff(density(ROWS, illuminant))).max() / STEP / drawn_weight(illuminant)
    wanted = (np.arange(count) + 0.5) / count
    np.testing.assert_allclose(share_below(found, illuminant), wanted, atol=slope * OWN_STEP**2 / 8 + 1e-12, rtol=0)


@EACH
def test_the_weight_is_the_integral(illuminant):
    rows = density(ROWS, illuminant)
    assert drawn_weight(illuminant) == pytest.approx(((rows[1:] + rows[:-1]) / 2 * STEP).sum(), rel=1e-12)


def test_equal_energy_weighs_three():
    """For equal energy X, Y and Z are 1 each by the observer's definition; its table keeps that to 4e-4."""
    assert drawn_weight("E") == pytest.approx(3, rel=4e-4)


@EACH
@pytest.mark.parametrize("count", [64, 512])
def test_a_mean_over_draws_is_an_integral(count, illuminant):
    """A mean over n middles has an error of at most the function's total variation over 2 n (Koksma). Tested for waves
    in the wavelength, and for the colours of single wavelengths, which add up to white."""
    fine = np.linspace(ROWS[0], ROWS[-1], 4001)
    weights = density(fine, illuminant) * np.gradient(fine)
    weights[[0, -1]] /= 2

    def is_found(function, wanted):
        values = function(wavelength_quantiles(count, illuminant))
        bound = np.abs(np.diff(function(fine), axis=0)).sum(axis=0) / (2 * count)
        found = values.mean(axis=0) * drawn_weight(illuminant)
        assert (np.abs(found - wanted) <= bound * drawn_weight(illuminant)).all()

    for waves in (1, 3, 10):
        wave = partial(cosine, waves)
        is_found(wave, wave(fine) @ weights)
    is_found(lambda x: observer(x, illuminant) / density(x, illuminant)[:, None], white_xyz(illuminant))


def cosine(waves, wavelengths):
    """A cosine with `waves` periods over the spectrum."""
    return np.cos(2 * np.pi * waves * (wavelengths - ROWS[0]) / (ROWS[-1] - ROWS[0]))


@EACH
def test_draws_pass_a_chi_square_test(illuminant):
    """At one in a thousand, in 32 bins of equal probability, each of which holds 16 of the 512 values."""
    rng = np.random.default_rng(0)

    def score(drawn):
        counts = np.bincount((share_below(drawn, illuminant) * 32).astype(int), minlength=32)
        return unlikeliness(counts, np.full(32, len(drawn) / 32))

    assert score(rng.choice(wavelength_quantiles(512, illuminant), 20_000)) < LIMIT
    assert score(rng.uniform(ROWS[0], ROWS[-1], 20_000)) > 10
