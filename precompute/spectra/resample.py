# SPDX-License-Identifier: GPL-3.0-or-later
"""From a transform's bins to a density over (u, v): blur by the kernel and resample, in two banded products."""

import math

import numpy as np

from .spectrum import FrequencyGrid

KERNEL_REACH = 5.5
# Fewer meet fewer bins out of reach of most of them, and OpenBLAS has faster kernels for products of under a million
# multiplications; yet fewer are small change to a matrix product.
_ROWS_PER_BLOCK = 16


class Resampler:
    """Blur and resample one wavelength's bins onto the grid u x v.

    out = G_v power G_u^T with G[i, j] = N(u_i - lambda q_j; sigma); only the bins `kept` (rows, columns) within reach
    of the grid enter, and each block of rows only meets the bins within reach of it. Places further than `radius` from
    the middle of (u, v) may be left at 0."""

    def __init__(self, grid: FrequencyGrid, u: np.ndarray, v: np.ndarray, lam: float, sigma: float, radius=math.inf):
        sides = ((grid.q_y, v), (grid.q_x, u))
        reach = KERNEL_REACH * sigma
        self.kept = tuple(_within(lam * q, axis[0], axis[-1], reach) for q, axis in sides)
        rows, cols = (_gaussian_blocks(lam * q[k], axis, sigma) for (q, axis), k in zip(sides, self.kept, strict=True))
        centres = lam * grid.q_x[self.kept[1]]
        self._rows = [
            (out, bins, _within(centres, -far, far, reach), factor)
            for out, bins, factor in rows
            if (far := _half_chord(v[out], radius)) > 0
        ]
        self._cols = [
            (_within(v, -far, far, 0.0), out, bins, factor.T)
            for out, bins, factor in cols
            if (far := _half_chord(u[out], radius)) > 0
        ]
        self._shape = len(v), len(u)

    def __call__(self, power: np.ndarray) -> np.ndarray:
        """Density (len(v), len(u)), row along +v, of the kept bins' power (ny, nx)."""
        half = np.zeros((self._shape[0], power.shape[1]), power.dtype)
        for out, bins, columns, factor in self._rows:
            np.matmul(factor.astype(power.dtype), power[bins, columns], out=half[out, columns])
        image = np.zeros(self._shape, power.dtype)
        for rows, out, bins, factor in self._cols:
            np.matmul(half[rows, bins], factor.astype(power.dtype), out=image[rows, out])
        return image


def _half_chord(axis: np.ndarray, radius: float) -> float:
    """Half the longest chord of the middle disc along the lines at `axis`; 0 where all pass by it."""
    nearest = 0.0 if axis[0] <= 0 <= axis[-1] else float(np.abs(axis).min())
    return math.sqrt(max(radius**2 - nearest**2, 0.0))


def _within(centres: np.ndarray, low: float, high: float, reach: float) -> slice:
    return slice(*np.searchsorted(centres, [low - reach, high + reach]))


def _gaussian_blocks(centres: np.ndarray, axis: np.ndarray, sigma: float):
    blocks = []
    for start in range(0, len(axis), _ROWS_PER_BLOCK):
        out = slice(start, min(start + _ROWS_PER_BLOCK, len(axis)))
        bins = _within(centres, axis[out][0], axis[out][-1], KERNEL_REACH * sigma)
        distance = (axis[out, None] - centres[None, bins]) / sigma
        # Further out they would be subnormal in single precision, for which some processors take a hundred cycles.
        near = np.abs(distance) <= KERNEL_REACH
        factor = near * np.exp(-0.5 * distance**2) / (np.sqrt(2 * np.pi) * sigma)
        blocks.append((out, bins, factor))
    return blocks
