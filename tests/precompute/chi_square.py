# SPDX-License-Identifier: GPL-3.0-or-later
"""Pearson's chi-square: whether draws follow a density."""

import numpy as np

# One sound sampler in a thousand is more unlikely than this.
LIMIT = 3.1


def unlikeliness(counts: np.ndarray, expected: np.ndarray, *, freedom: int | None = None) -> float:
    """How unlikely counts are where `expected` are expected, each at least 5: the standard normal number that is
    exceeded as rarely as their chi-square (Wilson and Hilferty 1931). Of n counts n - 1 are free, or `freedom`."""
    counts, expected = np.ravel(counts), np.ravel(expected)
    freedom = freedom or len(counts) - 1
    assert expected.min() >= 5
    assert np.isclose(counts.sum(), expected.sum(), rtol=1e-6)
    spread = 2 / (9 * freedom)
    chi_square = ((counts - expected) ** 2 / expected).sum()
    return float((np.cbrt(chi_square / freedom) - (1 - spread)) / np.sqrt(spread))


def equal_cells(shares: np.ndarray, count: int) -> np.ndarray:
    """For each of the outcomes, whose probabilities are `shares` (n,), one of at most `count` cells of neighbours, all
    about as probable."""
    middle = np.cumsum(shares) - np.asarray(shares) / 2
    cells = np.minimum((middle * count / np.sum(shares)).astype(int), count - 1)
    return np.unique(cells, return_inverse=True)[1]
