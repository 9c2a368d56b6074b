# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums a series' bins under the kernel at scattered places in (u, v), without a table.

From one wavelength to the next a place moves by few bins. So the bins that a place reaches are gathered once for
several wavelengths, at all nodes in s.
"""

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from .series import SpectrumSeries

# The kernel is cut at this many standard deviations, where it has fallen to 1.5e-8 of its peak.
CUT = 6.0
# Number of wavelengths, and of places times nodes in s, whose bins are gathered at once, to fit into a core's cache.
_WAVELENGTHS_AT_ONCE, _NODES_AT_ONCE = 12, 512


def density_at(
    series: SpectrumSeries, u: np.ndarray, v: np.ndarray, *, w: float, lambdas: np.ndarray, sigma: float
) -> np.ndarray:
    """The density (wavelengths, n) over (u, v) of the scattered light of each wavelength, at u and v (n,) and one w,
    under a kernel of standard deviation sigma in (u, v). The wavelengths are in order."""
    values = series.scattered_over_s2
    s = w / lambdas
    mix = (series.weights(s) * s[:, None] ** 2).astype(values.dtype)
    left = np.array([series.kernel_left(sigma, lam) for lam in lambdas])
    order = np.argsort(np.maximum(np.abs(u), np.abs(v)))  # places near (0, 0) move least
    found = np.empty((len(lambdas), len(u)))
    at_once = max(1, _NODES_AT_ONCE // len(values))
    for start in range(0, len(u), at_once):
        part = order[start : start + at_once]
        for first in range(0, len(lambdas), _WAVELENGTHS_AT_ONCE):
            group = slice(first, first + _WAVELENGTHS_AT_ONCE)
            row, down = _reached(series.grid.q_y, v[part], lambdas[group], left[group, 0])
            column, across = _reached(series.grid.q_x, u[part], lambdas[group], left[group, 1])
            window = down.shape[1], across.shape[1]
            windows = sliding_window_view(values, window, axis=(1, 2)).transpose(1, 2, 0, 3, 4)
            near = windows[row, column]
            along = near.reshape(len(near), -1, window[1]) @ across
            along = along.reshape(*near.shape[:3], -1)
            mixed = (along * mix[group].T[:, None]).sum(axis=1)
            found[group, part] = (mixed * down).sum(axis=1).T
    return found / (2 * math.pi * left.prod(axis=1, keepdims=True))


def _reached(q: np.ndarray, at: np.ndarray, lambdas: np.ndarray, sigma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The first (n,) of as many of the bins q around each place `at` (n,) as the kernel of any wavelength reaches, and
    the kernel (n, bins, wavelengths) there, whose peak is 1. Its standard deviation is sigma (wavelengths,)."""
    step = q[1] - q[0] if len(q) > 1 else math.inf
    ends = (at / lambdas[[0, -1], None] - q[0]) / step
    reach = CUT * (sigma / lambdas).max() / step
    first = np.floor(ends.min(axis=0) - reach).astype(int)
    count = min(math.ceil(np.ptp(ends, axis=0).max() + 2 * reach) + 2, len(q))
    first = np.clip(first, 0, len(q) - count)
    from_first = (at[:, None] - q[first, None] * lambdas) / sigma
    distance = from_first[:, None] - (q[:count, None] - q[0]) * (lambdas / sigma)
    distance = distance.astype(np.float32)  # in which exponentials are fast
    return first, (np.abs(distance) <= CUT) * np.exp(-0.5 * distance**2)
