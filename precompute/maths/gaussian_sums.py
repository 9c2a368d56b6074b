# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums of samples on a lattice under a Gaussian about given places."""

import math

import numpy as np

# Number of values gathered at once, to limit memory.
_GATHERED = 4_000_000


def gaussian_sums(
    samples: np.ndarray, y: np.ndarray, x: np.ndarray, *, sigma: tuple[float, float], cut: float
) -> np.ndarray:
    """The sums (n, channels) of samples (rows, columns, channels) under a Gaussian about the places y and x (n,).

    Places, and the standard deviations `sigma` along y and x, count in samples. The Gaussian's integral is 1. It is cut
    at `cut` standard deviations. There is nothing beyond the lattice."""
    rows, columns, channels = samples.shape
    row, down = _taps(y, rows, sigma[0], cut)
    column, across = _taps(x, columns, sigma[1], cut)
    flat = samples.reshape(rows * columns, channels)
    found = np.empty((len(y), channels))
    at_once = max(1, _GATHERED // (row.shape[1] * column.shape[1] * channels))
    for start in range(0, len(y), at_once):
        part = slice(start, start + at_once)
        # All indices are within the lattice; of NumPy's modes, wrapping is the fastest.
        near = flat.take(row[part, :, None] * columns + column[part, None, :], axis=0, mode="wrap")
        along = down[part, None, :].astype(flat.dtype) @ near.reshape(*near.shape[:2], -1)
        found[part] = np.einsum("nxc,nx->nc", along.reshape(len(near), -1, channels), across[part])
    return found


def _taps(at: np.ndarray, count: int, sigma: float, cut: float) -> tuple[np.ndarray, np.ndarray]:
    """Indices (n, m) of the samples near places (n,), and the Gaussian there; 0 beyond the lattice."""
    reach = math.ceil(cut * sigma)
    index = np.rint(at).astype(int)[:, None] + np.arange(-reach, reach + 1)
    gaussian = np.exp(-0.5 * ((at[:, None] - index) / sigma) ** 2) / (math.sqrt(2 * math.pi) * sigma)
    return np.clip(index, 0, count - 1), gaussian * ((index >= 0) & (index < count))
