# SPDX-License-Identifier: GPL-3.0-or-later
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.maths.chebyshev import (
    bessel_j,
    coefficients_from_nodes,
    interpolation_matrix,
    jacobi_anger_terms,
    nodes,
    polynomials,
)

few = settings(deadline=None, max_examples=40)
T = np.linspace(-1, 1, 2001)


def bessel_integral(z, count):
    """J_n(z) = (1 / pi) integral over [0, pi] of cos(n t - z sin t), by a sum over equal steps. The integrand is
    periodic and entire, so the sum is exact to rounding with somewhat more than n + z steps (Trefethen and Weideman
    2014)."""
    steps = int(z + count + 80)
    t = 2 * np.pi * np.arange(steps) / steps
    return np.mean(np.cos(np.arange(count)[:, None] * t - z * np.sin(t)), axis=1)


def phase_error(z, count):
    """Largest error of interpolating exp(i z t) at `count` nodes."""
    values = np.exp(1j * z * nodes(count, -1, 1))
    return np.abs(interpolation_matrix(T, count, lower=-1, upper=1) @ values - np.exp(1j * z * T)).max()


@few
@given(st.floats(1e-30, 120) | st.just(0.0), st.integers(1, 300))
def test_bessel_is_its_integral(z, count):
    """A relief of 2 um has z = 33. The integrand's phase is at most 2 pi 300 and is rounded by at most 2e-13."""
    np.testing.assert_allclose(bessel_j(z, count), bessel_integral(z, count), rtol=0, atol=4e-13)


@pytest.mark.parametrize("z", [1e-24, 1e-12, 1e-6, 1e-3, 0.1])
def test_bessel_of_small_arguments(z):
    """Against the power series (z / 2)^n / n! (1 - (z / 2)^2 / (n + 1) + (z / 2)^4 / (2 (n + 1) (n + 2))); the next
    term is below (0.05)^6 / 6 = 3e-9 of the first."""
    x = z / 2
    expected = [x**n / math.factorial(n) * (1 - x**2 / (n + 1) + x**4 / (2 * (n + 1) * (n + 2))) for n in range(6)]
    np.testing.assert_allclose(bessel_j(z, 6), expected, rtol=4e-9)


def test_bessel_of_nothing_is_one_and_zeros():
    np.testing.assert_array_equal(bessel_j(0, 4), [1, 0, 0, 0])


@few
@given(st.floats(1e-30, 100))
def test_bessel_squares_sum_to_one(z):
    """J_0^2 + 2 sum J_n^2 = 1, the energy of a sinusoidal grating; at most 160 terms."""
    j = bessel_j(z, int(z) + 60)
    assert j[0] ** 2 + 2 * np.sum(j[1:] ** 2) == pytest.approx(1, abs=1e-12)


@few
@given(st.integers(1, 60), st.floats(-5, 5), st.floats(0.01, 5))
def test_nodes_ascend_inside_the_interval(count, lower, width):
    at = nodes(count, lower, lower + width)
    assert len(at) == count
    assert (np.diff(at) > 0).all()
    assert lower < at[0] and at[-1] < lower + width


def test_polynomials_follow_the_recurrence():
    """T_n+1 = 2 t T_n - T_n-1. The product n arccos(t) is rounded by n pi 1e-16."""
    values = polynomials(T, 40)
    np.testing.assert_array_equal(values[:, 0], 1)
    np.testing.assert_allclose(values[:, 1], T, atol=1e-15)
    np.testing.assert_allclose(values[:, 2:], 2 * T[:, None] * values[:, 1:-1] - values[:, :-2], atol=4e-14)


@few
@given(st.integers(1, 40), st.integers(0, 2**32))
def test_coefficients_come_back(count, seed):
    """The rounding of a cosine transform of up to 40 numbers of size 1 is about 40 * 40 * 1e-16."""
    coefficients = np.random.default_rng(seed).standard_normal(count)
    values = polynomials(nodes(count, -1, 1), count) @ coefficients
    np.testing.assert_allclose(coefficients_from_nodes(count) @ values, coefficients, atol=1e-12)


@few
@given(st.integers(2, 20), st.integers(0, 2**32), st.floats(-3, 3), st.floats(0.1, 4))
def test_interpolation_is_exact_for_polynomials(count, seed, lower, width):
    """Polynomials of a degree below the count, with values up to 10; the Lebesgue constant of 20 nodes is 3."""
    rng = np.random.default_rng(seed)
    coefficients = rng.standard_normal(count)
    upper = lower + width
    x = rng.uniform(lower, upper, (3, 5))

    def polynomial(at):
        return np.polynomial.Chebyshev(coefficients, domain=[lower, upper])(at)

    matrix = interpolation_matrix(x, count, lower=lower, upper=upper)
    assert matrix.shape == (3, 5, count)
    np.testing.assert_allclose(matrix @ polynomial(nodes(count, lower, upper)), polynomial(x), atol=1e-11)


@few
@given(st.floats(0.1, 60), st.floats(2, 11))
def test_a_phase_is_met_within_its_tolerance(z, digits):
    """The bound is rigorous. The matrix also rounds phases of up to count * pi = 300 by 1e-13."""
    tolerance = 10.0**-digits
    assert phase_error(z, jacobi_anger_terms(z, tolerance)) <= tolerance + 1e-12


@pytest.mark.parametrize("z", [0.1, 0.5, 1, 2, 5, 10, 20, 35, 60])
@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6, 1e-9])
def test_a_phase_takes_hardly_more_terms_than_the_least(z, tolerance):
    """The bound exceeds the true error by a factor of 4 to 8, which costs three or four terms. It adds moduli where the
    true tail partly cancels, and counts every term twice. From n = z on, each J_n is smaller than the one before by a
    factor of at least 2 (1.5 just past z = 60)."""
    enough = jacobi_anger_terms(z, tolerance)
    least = next(count for count in range(1, enough + 1) if phase_error(z, count) <= tolerance)
    assert enough - least <= 4


def test_more_relief_or_digits_take_more_terms():
    assert jacobi_anger_terms(0, 1e-6) == 1
    by_depth = [jacobi_anger_terms(z, 1e-6) for z in np.linspace(0, 60, 30)]
    by_digits = [jacobi_anger_terms(10, 10.0**-d) for d in range(1, 12)]
    assert by_depth == sorted(by_depth) and by_depth[-1] > 60
    assert by_digits == sorted(by_digits) and len(set(by_digits)) > 5
