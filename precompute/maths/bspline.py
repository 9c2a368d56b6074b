# SPDX-License-Identifier: GPL-3.0-or-later
"""Samples read by the uniform cubic B-spline, as Blender's Cubic interpolation reads a picture in either engine.

Nothing is prefiltered, so that a reading is the samples' convolution with the B-spline: a little wider than what was
sampled, by VARIANCE steps squared along each axis, and otherwise true to the fourth order of the step.
"""

import numpy as np

VARIANCE = 1 / 3


def weights(f: np.ndarray) -> np.ndarray:
    """Weights (4, ...) of the samples at -1, 0, 1, 2 for a place f (...,) in [0, 1], in f's own precision."""
    out = np.empty((4, *f.shape), f.dtype)
    rest = 1 - f
    out[0], out[3] = rest * rest * rest / 6, f * f * f / 6
    out[1] = 2 / 3 - f * f * (1 - f / 2)
    out[2] = 2 / 3 - rest * rest * (1 - rest / 2)
    return out


def taps(x: np.ndarray, count: int, precision: type = np.float64) -> tuple[np.ndarray, np.ndarray]:
    """First (...,) of the four samples around x (...,), from 1 to count - 2 in steps from the first of `count` samples,
    and the weights (4, ...) of the four."""
    below = np.clip(x.astype(np.intp), 1, count - 3)
    return below - 1, weights((x - below).astype(precision))


def read_curve(samples: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Samples (count, channels) read at x (...,), from 1 to count - 2; (..., channels)."""
    first, share = taps(x, len(samples))
    return sum(share[k][..., None] * samples[first + k] for k in range(4))


def patches(y: np.ndarray, x: np.ndarray, rows: int, columns: int, precision: type = np.float64):
    """Flat indices (16, n) into rows x columns samples of those around y, x (n,), and the weight (16, n) of each."""
    (row, of_row), (column, of_column) = taps(y, rows, precision), taps(x, columns, precision)
    around = np.arange(4)[:, None] * columns + np.arange(4)
    return around.reshape(16, 1) + (row * columns + column), (of_row[:, None] * of_column).reshape(16, -1)


def read_grid(samples: np.ndarray, y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Samples (rows, columns) read at y, x (...,), from 1 to count - 2; (...,)."""
    places, share = patches(np.ravel(y), np.ravel(x), *samples.shape, samples.dtype.type)
    return np.einsum("mn,mn->n", share, samples.ravel().take(places, mode="wrap")).reshape(np.shape(y))
