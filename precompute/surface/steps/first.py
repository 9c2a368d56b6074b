# SPDX-License-Identifier: GPL-3.0-or-later
"""Start values in the panel for steps without defaults: they change the scan little or not at all."""

from __future__ import annotations

from collections.abc import Callable

from ..height_map import HeightMap
from .main_wave import main_wave
from .pipeline import KINDS
from .step import Step

# A sharp tip, in nanometres.
_TIP_NM = 10.0


def _whole(height_map: HeightMap) -> tuple[float, ...]:
    """Return the rectangle of the whole scan, in micrometres."""
    ly, lx = height_map.size_m
    return 0.0, 0.0, lx * 1e6, ly * 1e6


def _middle(height_map: HeightMap) -> tuple[float, ...]:
    """Return a rectangle in the scan's middle, a tenth of its sides, in micrometres."""
    ly, lx = height_map.size_m
    return 0.45e6 * lx, 0.45e6 * ly, 0.55e6 * lx, 0.55e6 * ly


_VALUES: dict[str, Callable[[HeightMap], tuple[float, ...]]] = {
    "rotate": lambda _: (0.0,),
    "crop": _whole,
    "mask": _middle,
    "calibrate": lambda height_map: (main_wave(height_map, "calibrate").period_m * 1e9,),
    "zscale": lambda _: (1.0,),
    "tip": lambda _: (_TIP_NM,),
}


def first_step(name: str, height_map: HeightMap) -> Step:
    """Make a step for a scan, with its defaults or with values that suit the scan.

    Raises GratingError if the scan has no grating to calibrate by."""
    values = _VALUES[name](height_map) if name in _VALUES else ()
    return KINDS[name].read([f"{value:.5g}" for value in values], height_map.source)
