# SPDX-License-Identifier: GPL-3.0-or-later
"""Weighted sums of successive rows."""

import numpy as np
import pytest

from precompute.maths.bspline import banded_sums


@pytest.mark.parametrize(("edge", "mode"), [(False, "constant"), (True, "edge")])
@pytest.mark.parametrize("rows", [1, 5, 60])
def test_it_is_the_sum_over_padded_rows(edge, mode, rows):
    """Sums from far before the first row to far beyond the last, more of them than one product makes. Rounding in
    double precision is below 1e-12."""
    rng = np.random.default_rng(0)
    samples = rng.random((2, rows, 3))
    first = np.sort(rng.integers(-20, rows + 20, 50))
    weights = rng.normal(size=(50, 7))
    padded = np.pad(samples, [(0, 0), (40, 40), (0, 0)], mode=mode)
    expected = sum(weights[:, k, None] * padded[:, first + k + 40] for k in range(7))
    np.testing.assert_allclose(banded_sums(samples, first, weights, edge=edge), expected, rtol=0, atol=1e-12)


def test_the_kind_of_float_stays():
    samples = np.ones((1, 4, 2), np.float32)
    assert banded_sums(samples, np.arange(3), np.ones((3, 2))).dtype == np.float32
