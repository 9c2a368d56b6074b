# SPDX-License-Identifier: GPL-3.0-or-later
"""Waves that both ways over the lines of a scan show: those of the surface, and not those of the microscope.

A microscope scans each line forth and back. The surface is the same both times, but the shifts of the lines and a hum
are not: a hum that is a wave (ky, kx) on the way forth is (ky, -kx) on the way back. A wave's mirror image is therefore
no confirmation.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from .height_map import HeightMap
from .height_spectrum import Spectrum, amplitude_at, refined
from .holes import fill_missing

# The least share of the weaker of two amplitudes in the other. A wave that is one bin beside another, the resolution of
# a scan, has half of its amplitude there under a Hann window. On the real files of both ways it is 0.93 to 0.99.
_SHARE = 0.5
# How far a way may be shifted against the other, in shares of the scan along B and T. On the real files it is 0.012
# along B. Along the lines a scanner that is not corrected lags by much more.
_SHIFT = 0.02, 0.1
# By how much more their phases may differ, in radians. A wave that is 50 times over the median of the noise's power has
# phases that are off by 0.12 rad (rms) on each way: three times of both.
_PHASE = 0.5


def confirms(level: HeightMap, spectrum: Spectrum, other: HeightMap) -> Callable[[tuple[int, int]], bool]:
    """Whether the levelled heights of the other way show the wave of a peak (ky, kx) of the spectrum of `level`."""
    ways = [(fill_missing(each).height_m, each.size_m) for each in (level, other)]

    def is_shown(peak: tuple[int, int]) -> bool:
        cycles = refined(spectrum, peak)
        amplitudes = []
        for height, sides in ways:
            ky, kx = (each * side / own for each, side, own in zip(cycles, sides, spectrum.size_m, strict=True))
            amplitudes.append(amplitude_at(height, (ky, kx)) / height.size)
        forth, back = amplitudes
        if not _SHARE * abs(forth) <= abs(back) <= abs(forth) / _SHARE:
            return False
        shifted = 2 * math.pi * sum(abs(each) * shift for each, shift in zip(cycles, _SHIFT, strict=True))
        return bool(abs(np.angle(back * forth.conjugate())) <= shifted + _PHASE)

    return is_shown
