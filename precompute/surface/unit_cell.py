# SPDX-License-Identifier: GPL-3.0-or-later
"""What repeats in a relief: its exact unit cell, or the strongest period of an irregular one."""

from dataclasses import replace

import numpy as np

from ..base.failure import GratingError
from .description import describe
from .height_map import HeightMap
from .relief import Relief

# Share of the relief by which copies of a cell may differ: the rounding of levelling and refining.
_ALIKE = 1e-6


def unit_cell(relief: Relief) -> Relief:
    """The smallest piece that tiles a periodic relief exactly, at least as long along B as it is along T; the relief
    itself where nothing smaller does."""
    if not relief.periodic:
        return relief
    cols = _repeat(relief.height_m, 1, 1)
    rows = _repeat(relief.height_m, 0, min(cols, relief.height_m.shape[0]))
    apodisation_axes = relief.apodisation_axes[0][:rows], relief.apodisation_axes[1][:cols]
    return replace(relief, height_m=relief.height_m[:rows, :cols], apodisation_axes=apodisation_axes)


def _repeat(height: np.ndarray, axis: int, least: int) -> int:
    count = height.shape[axis]
    allowed = _ALIKE * max(np.ptp(height), 1e-12)
    for length in range(least, count // 2 + 1):
        if count % length == 0 and np.abs(height - np.roll(height, length, axis)).max() <= allowed:
            return length
    return count


def grating_period(relief: Relief, period_m: float | None = None) -> float:
    """The asked period in metres, else the unit cell's along T, else the strongest of the relief.

    Raises GratingError where nothing repeats."""
    if period_m is not None:
        return period_m
    cell = unit_cell(relief)
    if 1 < cell.height_m.shape[1] < relief.height_m.shape[1]:
        return cell.size_m[1]
    heights = HeightMap(relief.height_m[::-1], relief.pixel_size_m, "relief", periodic=relief.periodic)
    periods = describe(heights)["periods_m"]
    if not periods:
        raise GratingError("the relief has no period; give --period-nm")
    return periods[0]
