# SPDX-License-Identifier: GPL-3.0-or-later
"""Step that removes the rounding by the microscope's tip."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..height_map import HeightMap
from ..holes import fill_missing
from .step import Done


def remove_tip(height_map: HeightMap, radius_nm: float) -> Done:
    """Erode the heights by a tip of this radius, after filling holes: the result is the highest surface that gives this
    scan (Villarrubia, Journal of Research of NIST 102, 1997).

    Near its apex a round tip is a paraboloid, r^2 / (2 R), so the erosion separates into the two axes."""
    height = fill_missing(height_map).height_m
    span = float(np.ptp(height))
    eroded = height
    for axis, pixel in enumerate(height_map.pixel_size_m):
        eroded = _eroded(eroded, axis, pixel**2 / (2e-9 * radius_nm), span)
    lowered = height - eroded
    touched = float((lowered > 1e-3 * span).mean())
    told = (
        f"{touched:.0%} of the pixels are lowered, by up to {lowered.max() * 1e9:.3g} nm; where the tip did not reach "
        "the ground, the ground stays unknown"
    )
    return Done(replace(height_map, height_m=eroded, periodic=False), told if touched else "no pixel is changed")


def _eroded(height: np.ndarray, axis: int, rise: float, span: float) -> np.ndarray:
    """Return the minimum, over shifts of k pixels along an axis, of the shifted height plus k^2 `rise`."""
    lowest = np.moveaxis(height, axis, 0).copy()
    line = np.moveaxis(height, axis, 0)
    # Farther out, the tip is above the whole relief and touches nothing.
    for k in range(1, min(len(line), int(np.sqrt(span / rise)) + 1)):
        np.minimum(lowest[k:], line[:-k] + k * k * rise, out=lowest[k:])
        np.minimum(lowest[:-k], line[k:] + k * k * rise, out=lowest[:-k])
    return np.moveaxis(lowest, 0, axis)
