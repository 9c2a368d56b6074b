# SPDX-License-Identifier: GPL-3.0-or-later
"""Interpolation by the uniform cubic B-spline, like Blender's Cubic image interpolation in both engines.

The samples of a bake's terms are not prefiltered, so interpolation convolves the sampled function with the B-spline.
This adds VARIANCE, in squared sample steps, to the function's variance along each axis. The remaining error is of
fourth order in the step. `interpolating` prefilters samples."""

import numpy as np

VARIANCE = 1 / 3


def weights(f: np.ndarray) -> np.ndarray:
    """Return the weights (4, ...) of the samples at -1, 0, 1 and 2 for f (...,) in [0, 1], in the precision of f."""
    out = np.empty((4, *f.shape), f.dtype)
    rest = 1 - f
    out[0], out[3] = rest * rest * rest / 6, f * f * f / 6
    out[1] = 2 / 3 - f * f * (1 - f / 2)
    out[2] = 2 / 3 - rest * rest * (1 - rest / 2)
    return out


def taps(x: np.ndarray, count: int, precision: type = np.float64) -> tuple[np.ndarray, np.ndarray]:
    """Find the four samples around each position, and their weights.

    x (...,), in [1, count - 2], counts steps from the first of `count` samples. Returns the index (...,) of the first
    of the four samples, and the weights (4, ...) in the given precision."""
    below = np.clip(x.astype(np.intp), 1, count - 3)
    return below - 1, weights((x - below).astype(precision))


def read_curve(samples: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Interpolate samples (count, channels) at x (...,) in [1, count - 2]; returns (..., channels)."""
    first, share = taps(x, len(samples))
    return sum(share[k][..., None] * samples[first + k] for k in range(4))


def patches(
    y: np.ndarray, x: np.ndarray, shape: tuple[int, int], *, precision: type = np.float64
) -> tuple[np.ndarray, np.ndarray]:
    """Find the 16 samples of a grid around each position, and their weights.

    `shape` is (rows, columns); y (n,) is in [1, rows - 2], x (n,) in [1, columns - 2]. Returns indices (16, n) into the
    flattened grid, and weights (16, n) in the given precision."""
    rows, columns = shape
    (row, of_row), (column, of_column) = taps(y, rows, precision), taps(x, columns, precision)
    around = np.arange(4)[:, None] * columns + np.arange(4)
    return around.reshape(16, 1) + (row * columns + column), (of_row[:, None] * of_column).reshape(16, -1)


def read_grid(samples: np.ndarray, y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Interpolate samples (rows, columns) at y in [1, rows - 2] and x in [1, columns - 2], both (...,)."""
    places, share = patches(np.ravel(y), np.ravel(x), samples.shape, precision=samples.dtype.type)
    return np.einsum("mn,mn->n", share, samples.ravel().take(places, mode="wrap")).reshape(np.shape(y))


def interpolating(values: np.ndarray) -> np.ndarray:
    """Prefilter values (rows, columns) to samples that interpolate them. The edge samples are repeated outward."""
    for axis, count in enumerate(values.shape):
        reading = (4 * np.eye(count) + np.eye(count, k=1) + np.eye(count, k=-1)) / 6
        reading[[0, -1], [0, -1]] = 5 / 6
        values = np.moveaxis(np.linalg.solve(reading, np.moveaxis(values, axis, 0)), 0, axis)
    return values


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
