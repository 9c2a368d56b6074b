# SPDX-License-Identifier: GPL-3.0-or-later
"""From a transform's bins to a density over (u, v): blur by the kernel and resample, in two banded products."""

import numpy as np

from .spectrum import FrequencyGrid

KERNEL_REACH = 5.5
_ROWS_PER_BLOCK = 64


class Resampler:
    """Blur and resample one wavelength's bins onto the grid u x v.

    out = G_v power G_u^T with G[i, j] = N(u_i - lambda q_j; sigma); only the bins `kept` (rows, columns) within reach
    of the grid enter, and each block of rows only meets the bins within reach of it."""

    def __init__(self, grid: FrequencyGrid, u: np.ndarray, v: np.ndarray, lam: float, sigma: float):
        sides = ((grid.q_y, v), (grid.q_x, u))
        self.kept = tuple(_within(lam * q, axis[0], axis[-1], KERNEL_REACH * sigma) for q, axis in sides)
        self._factors = [
            _gaussian_blocks(lam * q[k], axis, sigma) for (q, axis), k in zip(sides, self.kept, strict=True)
        ]
        self._shape = len(v), len(u)

    def __call__(self, power: np.ndarray) -> np.ndarray:
        """Density (len(v), len(u)), row along +v, of the kept bins' power (ny, nx)."""
        rows, cols = self._factors
        half = np.empty((self._shape[0], power.shape[1]), power.dtype)
        for out, bins, factor in rows:
            half[out] = factor.astype(power.dtype) @ power[bins]
        image = np.empty(self._shape, power.dtype)
        for out, bins, factor in cols:
            image[:, out] = half[:, bins] @ factor.astype(power.dtype).T
        return image


def _within(centres: np.ndarray, low: float, high: float, reach: float) -> slice:
    return slice(*np.searchsorted(centres, [low - reach, high + reach]))


def _gaussian_blocks(centres: np.ndarray, axis: np.ndarray, sigma: float):
    blocks = []
    for start in range(0, len(axis), _ROWS_PER_BLOCK):
        out = slice(start, min(start + _ROWS_PER_BLOCK, len(axis)))
        bins = _within(centres, axis[out][0], axis[out][-1], KERNEL_REACH * sigma)
        distance = (axis[out, None] - centres[None, bins]) / sigma
        factor = np.exp(-0.5 * distance**2) / (np.sqrt(2 * np.pi) * sigma)
        blocks.append((out, bins, factor))
    return blocks
