# SPDX-License-Identifier: GPL-3.0-or-later
"""Filling holes: pixels of a height map that were not measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .height_map import HeightMap
from .least_squares_plane import fitted_plane

# Relaxation sweeps on each level of the coarse-to-fine fill. A level starts from the smooth fill of the coarser level,
# so a few sweeps are enough to smooth the coarser level's steps.
_FILL_SWEEPS = 8


def fill_missing(height_map: HeightMap) -> HeightMap:
    """Replace every NaN by a height: the fitted plane plus a nearly harmonic interpolation of the residual.

    Measured heights are kept to the bit. A filled hole has no step at its rim, and its heights above the plane lie
    between the lowest and the highest that were measured, so the phasor gets no edge that the surface does not have.
    """
    missing = np.isnan(height_map.height_m)
    if not missing.any():
        return height_map
    plane = sum(fitted_plane(height_map.height_m))
    filled = _fill(height_map.height_m - plane) + plane
    return replace(height_map, height_m=np.where(missing, filled, height_map.height_m))


def _fill(height: np.ndarray) -> np.ndarray:
    """Fill NaN from a copy of half the size that was filled in the same way, then relax towards the mean of the
    neighbours."""
    missing = np.isnan(height)
    if not missing.any():
        return height
    rows, cols = height.shape
    coarse = _fill(_halve(height))
    filled = np.where(missing, np.repeat(np.repeat(coarse, 2, axis=0), 2, axis=1)[:rows, :cols], height)
    r, c = np.nonzero(missing)
    up, down = np.maximum(r - 1, 0), np.minimum(r + 1, rows - 1)
    left, right = np.maximum(c - 1, 0), np.minimum(c + 1, cols - 1)
    for _ in range(_FILL_SWEEPS):
        around = filled[up, c] + filled[down, c] + filled[r, left] + filled[r, right]
        filled[r, c] = (filled[r, c] + around) / 5
    return filled


def _halve(height: np.ndarray) -> np.ndarray:
    """The mean of the finite values of each 2 x 2 block; NaN where all four are NaN."""
    rows, cols = height.shape
    padded = np.pad(height, ((0, rows % 2), (0, cols % 2)), constant_values=np.nan)
    blocks = padded.reshape(padded.shape[0] // 2, 2, padded.shape[1] // 2, 2)
    count = np.isfinite(blocks).sum(axis=(1, 3))
    total = np.nansum(blocks, axis=(1, 3))
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
