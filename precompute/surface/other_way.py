# SPDX-License-Identifier: GPL-3.0-or-later
"""Confirms waves by the opposite scan direction: trace and retrace share the surface, but not the microscope's noise.

Line shifts and hum differ between the two. Hum that is a wave (ky, kx) in the trace is (ky, -kx) in the retrace, so a
wave's mirror image does not confirm it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from .height_map import HeightMap
from .height_spectrum import Spectrum, amplitude_at, refined
from .holes import fill_missing

# The least ratio of the weaker to the stronger amplitude. Under a Hann window a wave has half of its amplitude one bin
# away, the resolution of a scan. Real files with both directions have 0.93 to 0.99.
_SHARE = 0.5
# The largest shift between the two directions, as a share of the scan along B and T. Real files have 0.012 along B.
# Along the scan lines an uncorrected scanner lags much more.
_SHIFT = 0.02, 0.1
# The largest further phase difference in radians: three standard deviations. A wave of 50 times the noise's median
# power has a phase error of 0.12 rad (rms) in each direction.
_PHASE = 0.5


def confirms(level: HeightMap, spectrum: Spectrum, other: HeightMap) -> Callable[[tuple[int, int]], bool]:
    """Return a predicate: whether `other`, the levelled opposite scan, shows the wave of a peak in the spectrum."""
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
