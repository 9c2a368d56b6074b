# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the grating of a scan for the steps that need one."""

import cmath
import math

from ...base.failure import GratingError
from ..height_map import HeightMap
from ..least_squares_plane import level_plane
from ..periods import Wave, waves_of

# A harmonic has twice or three times the frequency of its grating, to about a bin of the spectrum.
_HARMONICS = (3, 2)
_BINS = 1.0


def main_wave(height_map: HeightMap, step: str) -> Wave:
    """Return the brightest wave, or its fundamental if it is a harmonic. Raises GratingError if there is no grating."""
    waves = waves_of(level_plane(height_map))
    if not waves.gratings:
        raise GratingError(height_map.source, f"{step}: no grating stands out of the scan", f"leave {step} out")
    first, *others = waves.gratings
    slower = [*others]
    if waves.waviness is not None and waves.waviness.amplitude_m > first.amplitude_m:
        slower.append(waves.waviness)
    found = (wave for times in _HARMONICS for wave in slower if _is_harmonic(first, wave, times))
    return next(found, first)


def _is_harmonic(fast: Wave, slow: Wave, times: int) -> bool:
    """Whether a wave has `times` the frequency of a slower one, in the same direction."""
    bins = [wave.repeats * cmath.exp(1j * math.radians(wave.angle_deg)) for wave in (fast, slow)]
    return min(abs(bins[0] - sign * times * bins[1]) for sign in (1, -1)) <= _BINS
