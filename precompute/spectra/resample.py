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

    The density is G_v power G_u^T with G[i, j] = N(u_i - lambda q_j; sigma), a normal density of a standard deviation
    along each axis, `sigmas` (along v, along u). `lam` is the wavelength in metres. `kept` holds the slices (rows,
    columns) of the grid's bins that the kernel reaches; a caller passes the power of these bins only. The density may
    stay 0 farther than `radius` from (0, 0)."""

    def __init__(
        self, grid: FrequencyGrid, u: np.ndarray, v: np.ndarray, lam: float, sigmas: tuple[float, float],
        radius: float = math.inf,
    ) -> None:  # fmt: skip
        reach_v, reach_u = (KERNEL_REACH * sigma for sigma in sigmas)
        sides = (lam * grid.q_y, v, reach_v), (lam * grid.q_x, u, reach_u)
        rows, columns = (slice(*np.searchsorted(q, [at[0] - reach, at[-1] + reach])) for q, at, reach in sides)
        self.kept = rows, columns
        centres = lam * grid.q_x[columns]
        self._rows = _blocks(lam * grid.q_y[rows], v, sigmas[0], across=centres, past=reach_u, radius=radius)
        self._cols = _blocks(centres, u, sigmas[1], across=v, past=0.0, radius=radius)
        self._shape = len(v), len(u)

    def __call__(self, power: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
        """The density (len(v), len(u)) of the power (ny, nx) of the kept bins; its row index runs along +v.

        `out` may hold the density. It stays as it is where the density may stay 0."""
        half = np.zeros((self._shape[0], power.shape[1]), power.dtype)
        for places, bins, across, factor in self._rows:
            np.matmul(factor.astype(power.dtype), power[bins, across], out=half[places, across])
        image = np.zeros(self._shape, power.dtype) if out is None else out
        for places, bins, across, factor in self._cols:
            np.matmul(half[across, bins], factor.T.astype(power.dtype), out=image[across, places])
        return image


def _blocks(
    centres: np.ndarray, axis: np.ndarray, sigma: float, *, across: np.ndarray, past: float, radius: float
) -> list[tuple[slice, slice, slice, np.ndarray]]:
    """The matrix G in blocks. Each has the slice of its points on the axis, the slice of the bins that the kernel
    reaches from these points, the slice of the positions `across` the axis that are at most `past` outside the disc of
    `radius` there, and this part of G. Blocks beyond the disc are left out."""
    first = np.arange(0, len(axis), _ROWS_PER_BLOCK)
    last = np.minimum(first + _ROWS_PER_BLOCK, len(axis)) - 1
    reach = KERNEL_REACH * sigma
    start, stop = np.searchsorted(centres, axis[first] - reach), np.searchsorted(centres, axis[last] + reach)
    # The longest chord that the disc cuts from the lines of a block.
    nearest = np.maximum(0, np.maximum(axis[first], -axis[last]))
    chord = np.sqrt(np.maximum(radius**2 - nearest**2, 0))
    low, high = np.searchsorted(across, -chord - past), np.searchsorted(across, chord + past)
    place = np.minimum(first[:, None] + np.arange(_ROWS_PER_BLOCK), len(axis) - 1)
    bins = np.minimum(start[:, None] + np.arange((stop - start).max()), len(centres) - 1)
    distance = (axis[place][:, :, None] - centres[bins][:, None, :]) / sigma
    # Factors beyond the reach are set to 0. Far beyond, they would be subnormal numbers in single precision, which cost
    # some processors 100 cycles per operation.
    factor = (np.abs(distance) <= KERNEL_REACH) * np.exp(-0.5 * distance**2) / (math.sqrt(2 * math.pi) * sigma)
    return [
        (slice(first[k], last[k] + 1), slice(start[k], stop[k]), slice(low[k], high[k]),
         factor[k, : last[k] + 1 - first[k], : stop[k] - start[k]])
        for k in np.flatnonzero(chord)
    ]  # fmt: skip
