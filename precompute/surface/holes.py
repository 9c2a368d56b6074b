# SPDX-License-Identifier: GPL-3.0-or-later
"""Filling the pixels of a height map that were not measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .height_map import HeightMap
from .levelling import fitted_plane

# Sweeps per level of the coarse-to-fine fill: each level starts from an already smooth guess, so that a few
# sweeps only round off the steps of the coarser grid.
_FILL_SWEEPS = 8


def fill_missing(hm: HeightMap) -> HeightMap:
    """Give every NaN a height: the fitted plane plus a nearly harmonic interpolation of what stands out.

    Measured pixels are kept to the bit, the rest carries no step at the rim of a hole and no value outside
    the measured ones (seen from the plane), so that the phasor has no edge that the surface does not have.
    """
    missing = np.isnan(hm.height_m)
    if not missing.any():
        return hm
    plane = sum(fitted_plane(hm.height_m))
    filled = _fill(hm.height_m - plane) + plane
    return replace(hm, height_m=np.where(missing, filled, hm.height_m))


def _fill(height: np.ndarray) -> np.ndarray:
    """Fill NaN from a half-size copy filled in the same way, then relax towards the neighbours' mean."""
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
    """Mean of the finite values in each 2 x 2 block; NaN where a block has none."""
    rows, cols = height.shape
    padded = np.pad(height, ((0, rows % 2), (0, cols % 2)), constant_values=np.nan)
    blocks = padded.reshape(padded.shape[0] // 2, 2, padded.shape[1] // 2, 2)
    count = np.isfinite(blocks).sum(axis=(1, 3))
    total = np.nansum(blocks, axis=(1, 3))
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
