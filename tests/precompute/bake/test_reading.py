# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading a table: cubic B-splines in (u, v), Chebyshev polynomials in w, a B-spline along Z(w)."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from precompute.bake.plan import texel_size
from precompute.maths import chebyshev
from precompute.table.table import ZERO_ORDER_SAMPLES, Table

few = settings(deadline=None, max_examples=25)


def linear_bake(terms=3, size=16):
    """A table with B_k = (k + 1) (a + b u + c v), which B-splines read exactly."""
    texel = texel_size(size)
    axis = (np.arange(size) + 0.5 - size / 2) * texel
    plane = 1 + 0.3 * axis[None, :, None] - 0.2 * axis[:, None, None] * np.array([1, 2, 3])
    tiles = np.stack([(k + 1) * plane for k in range(terms)])
    zero = np.linspace(0, 1, 5)[:, None] * [1, 2, 3]
    return Table(tiles, zero, 0.5, texel, "D65")


@few
@given(st.integers(0, 2**32), st.floats(0, 2))
def test_reading_is_cubic_and_chebyshev(seed, w):
    u, v = np.random.default_rng(seed).uniform(-2, 2, (2, 20))
    t = w - 1
    series = 1 + 2 * t + 3 * (2 * t**2 - 1)
    expected = series * (1 + 0.3 * u[:, None] - 0.2 * v[:, None] * np.array([1, 2, 3]))
    np.testing.assert_allclose(linear_bake().scattered_over_w2(u, v, w), expected, atol=1e-12)


def test_reading_takes_a_w_and_a_variance_for_each_place(baked):
    u, v, w = np.random.default_rng(0).uniform(0, 1.4, (3, 30))
    variance = np.linspace(0, 0.1, 30)
    read = baked.scattered_over_w2(u, v, w, variance=variance)
    each = [
        baked.scattered_over_w2(*(x[k : k + 1] for x in (u, v, w)), variance=variance[k : k + 1])[0] for k in range(30)
    ]
    # Sums in single precision, in another order.
    np.testing.assert_allclose(read, each, rtol=0, atol=1e-6 * np.abs(baked.terms).max())


def test_texels_are_read_at_their_middles(baked):
    """At a texel's middle, a B-spline reads two thirds of it and a sixth of each neighbour, along each axis."""
    places = np.array([50, 70, 90])
    at = baked.axes[0][places]
    found = baked.scattered_over_w2(at, at[::-1], 1.0)
    basis = chebyshev.polynomials(np.array(0.0), len(baked.terms))
    table = np.tensordot(basis, baked.terms, axes=1)
    for axis in (0, 1):
        table = (np.roll(table, 1, axis) + 4 * table + np.roll(table, -1, axis)) / 6
    np.testing.assert_allclose(found, table[places[::-1], places], atol=1e-5 * np.abs(baked.terms).max())


def test_the_zero_order_is_straight_where_its_samples_are():
    """As in a renderer the first sample is repeated, so at w = 0 a reading is too large by a sixth of a step."""
    w = np.array([0.5, 0.7, 1.0, 2.0])
    np.testing.assert_allclose(linear_bake().zero_order_xyz(w), (w / 2)[:, None] * [1, 2, 3], atol=1e-15)
    assert linear_bake().zero_order_xyz(0.0) == pytest.approx(np.array([1, 2, 3]) / 4 / 6)
    assert linear_bake().zero_order_xyz(0.7).shape == (3,)


def test_a_deep_curve_is_not_smoothed():
    """A reading by B-splines with samples at steps h has an error of Z'' h^2 / 6. For a relief of 2 um, Z(w) = exp(-(2
    pi 0.58 um w / 550 nm)^2), and the error is 2.2e-4: half a step of a half float at 1. Before w = 0 a reading repeats
    Z(0), which halves the error there."""
    w = np.linspace(0, 2, ZERO_ORDER_SAMPLES)
    rate = 2 * np.pi * 0.58 / 0.55
    table = Table(np.zeros((1, 9, 9, 3)), np.exp(-((rate * w[:, None]) ** 2)) * np.ones(3), 0.5, 1.0, "D65")
    at = np.linspace(0, 2, 4001)
    off = np.abs(table.zero_order_xyz(at)[:, 0] - np.exp(-((rate * at) ** 2))).max()
    assert off <= 2 * rate**2 * (2 / (ZERO_ORDER_SAMPLES - 1)) ** 2 / 6 <= 2.3e-4
