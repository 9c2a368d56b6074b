# SPDX-License-Identifier: GPL-3.0-or-later
"""Weighted sums of successive rows, as products with the blocks of a banded matrix."""

import numpy as np

# Number of sums that one product makes. A taller block has more zeros.
_SUMS_AT_ONCE = 16


def banded_sums(samples: np.ndarray, first: np.ndarray, weights: np.ndarray, *, edge: bool = False) -> np.ndarray:
    """The sums (k, n, columns) of rows of samples (k, rows, columns) under weights (n, taps), in the samples' kind of
    float.

    Sum i is over the rows from first[i] on; `first` (n,) ascends. Rows beyond the ends are 0, or with `edge` like the
    row at the end."""
    last = samples.shape[1] - 1
    rows = first[:, None] + np.arange(weights.shape[1])
    if not edge:
        weights = weights * ((rows >= 0) & (rows <= last))
    rows = np.clip(rows, 0, last)
    out = np.empty((len(samples), len(rows), samples.shape[2]), samples.dtype)
    for start in range(0, len(rows), _SUMS_AT_ONCE):
        part = slice(start, start + _SUMS_AT_ONCE)
        low, high = rows[start, 0], rows[part][-1, -1] + 1
        matrix = np.zeros((len(rows[part]), high - low))
        np.add.at(matrix, (np.arange(len(matrix))[:, None], rows[part] - low), weights[part])
        np.matmul(matrix.astype(samples.dtype), samples[:, low:high], out=out[:, part])
    return out
