# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps that invert heights, scale them, and calibrate the pixels to a known period."""

from __future__ import annotations

from dataclasses import replace

from ...base.failure import GratingError
from ..height_map import HeightMap
from .main_wave import main_wave
from .step import Done

# A microscope's scale is off by some percent. The first limit gives a warning, the second (another grating) an error.
_FACTOR_USUAL, _FACTOR_MAX = 1.1, 1.5


def invert(height_map: HeightMap) -> Done:
    """Invert heights, for the scan of a replica or a stamp."""
    return Done(replace(height_map, height_m=-height_map.height_m))


def scale_heights(height_map: HeightMap, factor: float) -> Done:
    """Multiply all heights."""
    return Done(replace(height_map, height_m=height_map.height_m * factor))


def calibrate(height_map: HeightMap, period_nm: float) -> Done:
    """Scale the pixels so that the grating has its known period."""
    measured_m = main_wave(height_map, "calibrate").period_m
    factor = period_nm * 1e-9 / measured_m
    if not 1 / _FACTOR_MAX <= factor <= _FACTOR_MAX:
        raise GratingError(
            height_map.source,
            f"calibrate: its grating measures {measured_m * 1e9:.4g} nm, far from {period_nm:g} nm",
            "give the period of that grating, or leave calibrate out",
        )
    dy, dx = (side * factor for side in height_map.pixel_size_m)
    told = f"the grating of {measured_m * 1e9:.4g} nm has {period_nm:g} nm now, by pixels {factor:.4g} times as large"
    unusual = not 1 / _FACTOR_USUAL <= factor <= _FACTOR_USUAL
    if unusual:
        told += f"; a microscope errs by less, so check that this is the grating of {period_nm:g} nm"
    return Done(replace(height_map, pixel_size_m=(dy, dx)), told, warns=unusual)
