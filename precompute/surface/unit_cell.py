# SPDX-License-Identifier: GPL-3.0-or-later
"""The repeating part of a relief: the exact unit cell, or the strongest period if no cell repeats exactly."""

from dataclasses import replace

import numpy as np

from ..base.failure import GratingError, Setting
from .description import describe
from .height_map import HeightMap
from .relief import Relief

# Copies of a cell may differ by this share of the relief's range, the rounding errors of levelling and upsampling.
_ALIKE = 1e-6


def unit_cell(relief: Relief) -> Relief:
    """Return the smallest cell that tiles a periodic relief exactly, or else the relief itself.

    The cell has at least as many rows as columns, or all rows of the relief."""
    if not relief.periodic:
        return relief
    cols = _repeat(relief.height_m, 1, 1)
    rows = _repeat(relief.height_m, 0, min(cols, relief.height_m.shape[0]))
    apodisation_axes = relief.apodisation_axes[0][:rows], relief.apodisation_axes[1][:cols]
    return replace(relief, height_m=relief.height_m[:rows, :cols], apodisation_axes=apodisation_axes)


def _repeat(height: np.ndarray, axis: int, least: int) -> int:
    """Return the shortest period in pixels, at least `least`, of the heights along an axis."""
    count = height.shape[axis]
    allowed = _ALIKE * max(np.ptp(height), 1e-12)
    for length in range(least, count // 2 + 1):
        if count % length == 0 and np.abs(height - np.roll(height, length, axis)).max() <= allowed:
            return length
    return count


def grating_period(relief: Relief, period_m: float | None = None) -> float:
    """Return a relief's period in metres: `period_m` if given, else the unit cell's length along T, else the brightest
    period in the spectrum. Raises GratingError if there is none of the three."""
    if period_m is not None:
        return period_m
    cell = unit_cell(relief)
    if 1 < cell.height_m.shape[1] < relief.height_m.shape[1]:
        return cell.size_m[1]
    heights = HeightMap(relief.height_m[::-1], relief.pixel_size_m, "relief", periodic=relief.periodic)
    periods = describe(heights).periods_m
    if not periods:
        raise GratingError("", "the relief has no period", ("give ", Setting.PERIOD_NM))
    return periods[0]
