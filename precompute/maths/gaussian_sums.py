# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums of samples on a lattice under a Gaussian about given places."""

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

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
    # In a row of samples, their channels follow each other.
    window = down.shape[1], across.shape[1] * channels
    windows = sliding_window_view(samples.reshape(rows, -1), window)
    found = np.empty((len(y), channels))
    at_once = max(1, _GATHERED // math.prod(window))
    for start in range(0, len(y), at_once):
        part = slice(start, start + at_once)
        near = windows[row[part], channels * column[part]]
        along = down[part, None, :].astype(samples.dtype) @ near
        found[part] = np.einsum("nxc,nx->nc", along.reshape(len(near), -1, channels), across[part])
    return found


def _taps(at: np.ndarray, count: int, sigma: float, cut: float) -> tuple[np.ndarray, np.ndarray]:
    """The first (n,) of the samples near each place that the Gaussian reaches, and the Gaussian (n, samples) there."""
    reach = math.ceil(cut * sigma)
    nearest = np.rint(at).astype(int)
    taps = min(2 * reach + 1, count)
    first = np.clip(nearest - reach, 0, count - taps)
    index = first[:, None] + np.arange(taps)
    gaussian = np.exp(-0.5 * ((at[:, None] - index) / sigma) ** 2) / (math.sqrt(2 * math.pi) * sigma)
    return first, gaussian * (np.abs(index - nearest[:, None]) <= reach)
