# SPDX-License-Identifier: GPL-3.0-or-later
"""Line alignment: shifts each scan line (row) in height to fit its neighbours.

It also removes a grating whose lines run along the scan lines, so it runs only on request."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from ..height_map import HeightMap
from .loss import told_loss
from .step import Done


def align_lines(height_map: HeightMap, by: str) -> Done:
    """Shift each row; rows without heights stay. "median" gives each row the median zero. "difference" gives all rows
    the same typical difference from the row above, which slopes and particles hardly change."""
    aligned = aligned_rows(height_map.height_m, by)
    return told_loss(height_map, replace(height_map, height_m=aligned, periodic=False))


def aligned_rows(height: np.ndarray, by: str) -> np.ndarray:
    """Return heights (rows, cols) with shifted rows; see align_lines."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # from a missing row
        if by == "median":
            shift = np.nanmedian(height, axis=1)
        else:
            steps = _middle_mean(np.diff(height, axis=0))
            # Gentle rises and steep falls have a median difference in every row, which would add up to a tilt.
            shift = np.concatenate([[0.0], np.cumsum(np.nan_to_num(steps - np.nanmean(steps)))])
    return height - np.nan_to_num(shift)[:, None]


def _middle_mean(values: np.ndarray) -> np.ndarray:
    """Average the middle half of each row's finite values: (rows, cols) to (rows,), NaN for a row without any.

    A median would be too coarse: of heights in steps (8 bits, say) it is a step too, and the errors would add up over a
    thousand rows to more than the relief."""
    ordered = np.sort(values, axis=1)  # NaN last
    counts = np.isfinite(values).sum(axis=1)
    low, high = (counts // 4)[:, None], (counts - counts // 4)[:, None]
    place = np.arange(values.shape[1])
    return np.nanmean(np.where((place >= low) & (place < high), ordered, np.nan), axis=1)
