# SPDX-License-Identifier: GPL-3.0-or-later
"""Line alignment: each row, one line of the microscope's fast scan, is shifted so that it fits its neighbours.

A grating whose lines run along the rows is taken out with the shifts, so this is done only where it is asked for.
"""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from ..height_map import HeightMap
from .loss import told_loss
from .step import Done


def align_lines(height_map: HeightMap, by: str) -> Done:
    """Shift each row: by "median", to a median of zero; by "difference", so that the median of its differences from
    the row above is zero, whatever part of the row a slope or a particle covers. A row without heights stays."""
    height = height_map.height_m
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of a row that is missing
        if by == "median":
            shift = np.nanmedian(height, axis=1)
        else:
            steps = _middle_mean(np.diff(height, axis=0))
            # A surface of gentle rises and steep falls has a median difference at every row. It would add up to a tilt.
            shift = np.concatenate([[0.0], np.cumsum(np.nan_to_num(steps - np.nanmean(steps)))])
    aligned = height - np.nan_to_num(shift)[:, None]
    return told_loss(height_map, replace(height_map, height_m=aligned, periodic=False))


def _middle_mean(values: np.ndarray) -> np.ndarray:
    """The mean of the middle half of each row's finite values, (rows,) of (rows, cols); NaN of a row without any.

    It is the median, made fine: heights come in steps (of 8 bits, say), and medians of differences, in such steps too,
    would add up over a thousand rows to more than the relief."""
    ordered = np.sort(values, axis=1)  # NaN last
    counts = np.isfinite(values).sum(axis=1)
    low, high = (counts // 4)[:, None], (counts - counts // 4)[:, None]
    place = np.arange(values.shape[1])
    return np.nanmean(np.where((place >= low) & (place < high), ordered, np.nan), axis=1)
