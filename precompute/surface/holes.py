# SPDX-License-Identifier: GPL-3.0-or-later
"""Fills holes: pixels of a height map that were not measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .height_map import HeightMap
from .least_squares_plane import fitted_plane

# Relaxation sweeps at each resolution: enough to smooth the steps of the fill at half the resolution.
_FILL_SWEEPS = 8


def fill_missing(height_map: HeightMap) -> HeightMap:
    """Replace every NaN by the fitted plane plus a nearly harmonic interpolation of the residual.

    Measured heights stay bit-identical. A filled hole has no step at its rim, and its heights above the plane stay
    within the range of the measured ones, so the phasor gets no false edge."""
    missing = np.isnan(height_map.height_m)
    if not missing.any():
        return height_map
    plane = sum(fitted_plane(height_map.height_m))
    filled = _fill(height_map.height_m - plane) + plane
    return replace(height_map, height_m=np.where(missing, filled, height_map.height_m))


def _fill(height: np.ndarray) -> np.ndarray:
    """Fill NaN from a copy of half the size, filled in the same way, then relax towards the neighbours' mean."""
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
    """Average the finite values of each 2 x 2 block; NaN if all four are NaN."""
    rows, cols = height.shape
    padded = np.pad(height, ((0, rows % 2), (0, cols % 2)), constant_values=np.nan)
    blocks = padded.reshape(padded.shape[0] // 2, 2, padded.shape[1] // 2, 2)
    count = np.isfinite(blocks).sum(axis=(1, 3))
    total = np.nansum(blocks, axis=(1, 3))
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
