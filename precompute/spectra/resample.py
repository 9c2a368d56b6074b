# SPDX-License-Identifier: GPL-3.0-or-later
"""Blurs a transform's bins by the kernel and resamples them to a density over (u, v), by two banded matrix products."""

import math

import numpy as np

from .spectrum import FrequencyGrid

# The kernel ends at this many standard deviations.
KERNEL_REACH = 5.5
# Rows of the result per matrix product. A tall block multiplies many zeros, because it includes every bin that any of
# its rows reaches. A low block stays under a million multiplications, for which OpenBLAS has faster kernels, but low
# blocks need more products, and each product takes time to start.
_ROWS_PER_BLOCK = 16


class Resampler:
    """Blurs and resamples the bins of one wavelength onto the grid of u (nu,) and v (nv,), both ascending.

    The density is G_v power G_u^T with G[i, j] = N(u_i - lambda q_j; sigma), a normal density of standard deviation
    sigma. `lam` is the wavelength in metres. `kept` holds the slices (rows, columns) of the grid's bins that the kernel
    reaches; a caller passes the power of these bins only. The density may stay 0 farther than `radius` from (0, 0)."""

    def __init__(
        self, grid: FrequencyGrid, u: np.ndarray, v: np.ndarray, lam: float, sigma: float, radius: float = math.inf
    ) -> None:
        sides = ((grid.q_y, v), (grid.q_x, u))
        reach = KERNEL_REACH * sigma
        kept_y, kept_x = (_within(lam * q, axis[0], axis[-1], reach) for q, axis in sides)
        self.kept = kept_y, kept_x
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
        """The density (len(v), len(u)) of the power (ny, nx) of the kept bins; its row index runs along +v."""
        half = np.zeros((self._shape[0], power.shape[1]), power.dtype)
        for out, bins, columns, factor in self._rows:
            np.matmul(factor.astype(power.dtype), power[bins, columns], out=half[out, columns])
        image = np.zeros(self._shape, power.dtype)
        for rows, out, bins, factor in self._cols:
            np.matmul(half[rows, bins], factor.astype(power.dtype), out=image[rows, out])
        return image


def _half_chord(axis: np.ndarray, radius: float) -> float:
    """Half the longest chord that a disc of `radius` around 0 cuts from the lines at the positions `axis` (n,).

    It is 0 if no line meets the disc."""
    nearest = 0.0 if axis[0] <= 0 <= axis[-1] else float(np.abs(axis).min())
    return math.sqrt(max(radius**2 - nearest**2, 0.0))


def _within(centres: np.ndarray, low: float, high: float, reach: float) -> slice:
    """The slice of ascending centres (n,) that are at most `reach` outside the interval from low to high."""
    return slice(*np.searchsorted(centres, [low - reach, high + reach]))


def _gaussian_blocks(centres: np.ndarray, axis: np.ndarray, sigma: float) -> list[tuple[slice, slice, np.ndarray]]:
    """The matrix G in blocks. Each has the slice of its points on the axis, the slice of the bins that the kernel
    reaches from these points, and this part of G."""
    blocks = []
    for start in range(0, len(axis), _ROWS_PER_BLOCK):
        out = slice(start, min(start + _ROWS_PER_BLOCK, len(axis)))
        bins = _within(centres, axis[out][0], axis[out][-1], KERNEL_REACH * sigma)
        distance = (axis[out, None] - centres[None, bins]) / sigma
        # Factors beyond the reach are set to 0. Far beyond, they would be subnormal numbers in single precision, which
        # cost some processors 100 cycles per operation.
        near = np.abs(distance) <= KERNEL_REACH
        factor = near * np.exp(-0.5 * distance**2) / (np.sqrt(2 * np.pi) * sigma)
        blocks.append((out, bins, factor))
    return blocks
