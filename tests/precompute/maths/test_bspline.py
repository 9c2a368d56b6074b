# SPDX-License-Identifier: GPL-3.0-or-later
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.maths import bspline

few = settings(deadline=None, max_examples=30)


def cubic(x):
    """The uniform cubic B-spline, piece by piece."""
    x = np.abs(x)
    return np.where(x < 1, 2 / 3 - x**2 + x**3 / 2, np.maximum(2 - x, 0) ** 3 / 6)


@few
@given(st.floats(0, 1))
def test_the_weights_are_the_b_splines(f):
    weights = bspline.weights(np.array([f]))[:, 0]
    np.testing.assert_allclose(weights, cubic(f - np.array([-1, 0, 1, 2])), atol=1e-15)
    assert weights.sum() == pytest.approx(1, abs=1e-15) and (weights >= 0).all()


def test_the_variance_is_what_a_reading_adds():
    """A straight line is read exactly; x^2 is read as x^2 + VARIANCE."""
    samples = np.arange(12.0)[:, None] ** [1, 2]
    x = np.linspace(1, 10, 50)
    expected = np.stack([x, x**2 + bspline.VARIANCE], axis=-1)
    np.testing.assert_allclose(bspline.read_curve(samples, x), expected, rtol=1e-13)


@few
@given(st.integers(0, 2**32), st.sampled_from([np.float32, np.float64]))
def test_a_grid_is_read_as_the_sum_over_all_its_samples(seed, precision):
    rng = np.random.default_rng(seed)
    samples = rng.standard_normal((7, 9)).astype(precision)
    y, x = rng.uniform(1, 5, (3, 20)), rng.uniform(1, 7, (3, 20))
    # The last readable position: the weight of the sample beyond it is zero.
    y[0, 0], x[0, 0] = 5, 7
    across = cubic(y[..., None] - np.arange(7)), cubic(x[..., None] - np.arange(9))
    expected = np.einsum("abi,ij,abj->ab", across[0], samples, across[1])
    np.testing.assert_allclose(bspline.read_grid(samples, y, x), expected, atol=20 * np.finfo(precision).eps)


def test_a_gaussian_is_read_to_the_fourth_order():
    """A Gaussian sampled narrower by VARIANCE is read as the original, with an error of order h^4, h = sigma / texels.
    At worst two parts of the error are equal. The B-spline's fourth cumulant, -h^4 / 30, adds 3 h^4 / 720 of the peak;
    the images of the samples' spectrum, 2 zeta(4) / (2 pi)^4 = 1 / 720, add as much."""
    worst = []
    for texels in (1, 1.5, 2, 3, 4):
        h = 1 / texels
        found = []
        for shift in np.linspace(0, 1, 9):
            at = (np.arange(-40, 41) + shift) * h
            samples = np.exp(-0.5 * at**2 / (1 - bspline.VARIANCE * h**2)) / np.sqrt(1 - bspline.VARIANCE * h**2)
            x = np.linspace(-4, 4, 200)
            read = bspline.read_curve(samples[:, None], x / h - shift + 40)[:, 0]
            found.append(np.abs(read - np.exp(-0.5 * x**2)).max())
        worst.append(max(found) * texels**4)
    assert worst == sorted(worst)[::-1]
    assert worst[-1] == pytest.approx(6 / 720, rel=0.05)
    assert worst[0] < 0.018
