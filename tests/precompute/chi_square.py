# SPDX-License-Identifier: GPL-3.0-or-later
"""Pearson's chi-square test: whether draws follow a density."""

import numpy as np

# A correct sampler exceeds this once in a thousand times.
LIMIT = 3.1


def unlikeliness(counts: np.ndarray, expected: np.ndarray, *, freedom: int | None = None) -> float:
    """The chi-square of counts against expected counts (each at least 5), as a standard normal deviate (Wilson and
    Hilferty 1931). `freedom` is the number of degrees of freedom, by default n - 1."""
    counts, expected = np.ravel(counts), np.ravel(expected)
    freedom = freedom or len(counts) - 1
    assert expected.min() >= 5
    assert np.isclose(counts.sum(), expected.sum(), rtol=1e-6)
    spread = 2 / (9 * freedom)
    chi_square = ((counts - expected) ** 2 / expected).sum()
    return float((np.cbrt(chi_square / freedom) - (1 - spread)) / np.sqrt(spread))


def equal_cells(shares: np.ndarray, count: int) -> np.ndarray:
    """For each outcome with probabilities `shares` (n,), the number of its cell. Cells join neighbours, at most `count`
    cells of about equal probability."""
    middle = np.cumsum(shares) - np.asarray(shares) / 2
    cells = np.minimum((middle * count / np.sum(shares)).astype(int), count - 1)
    return np.unique(cells, return_inverse=True)[1]
