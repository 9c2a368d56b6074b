# SPDX-License-Identifier: GPL-3.0-or-later
"""The periods of a relief, found as peaks of its power spectrum."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .height_map import HeightMap
from .holes import fill_missing

_MOST_PERIODS = 5


# A period is one only if it fits at least three times into the scan; what is longer is waviness.
_LEAST_REPEATS = 3.0


# Two peaks nearer than the window's main lobe (4 bins wide), or than the spread of the lobes of natural
# surfaces (a real Elaphe scan: +-15 %), are one.
_DISTINCT_BINS = 4.0


_DISTINCT_SHARE = 0.2


# Peaks below this share of the strongest are not told.
_FAINTEST_SHARE = 0.05


# White noise is speckle: over 10^7 bins its highest is ln(10^7) = 16 times the mean power, 23 times the median,
# and twice that at the corner of the band, where the weight q is highest (56 was seen). Gratings reach 10^5.
_ABOVE_MEDIAN = 100.0


# A wave of 1 pm is the rounding of a plane, no relief.
_FAINTEST_AMPLITUDE_M = 1e-12


@dataclass(frozen=True)
class _Spectrum:
    """power[row, col] of the windowed heights in square metres: a sine of amplitude a peaks at about a^2.

    Rows hold all vertical frequencies, columns the horizontal ones from 0 up, both in cycles per scan.
    """

    power: np.ndarray
    size_m: tuple[float, float]

    @property
    def ky(self) -> np.ndarray:
        return np.round(np.fft.fftfreq(len(self.power)) * len(self.power))[:, None]

    @property
    def kx(self) -> np.ndarray:
        return np.arange(self.power.shape[1])

    def at(self, ky: int, kx: int, cols: int) -> float:
        """The power at any pair of frequencies; that of a real surface is even, and repeats."""
        kx = (kx + cols // 2) % cols - cols // 2
        ky, kx = (ky, kx) if kx >= 0 else (-ky, -kx)
        return float(self.power[ky % len(self.power), kx])


def strongest_periods(level: HeightMap) -> tuple[list[float], list[float]]:
    spectrum = _spectrum(level)
    peaks = [_refine(spectrum, level.cols, *peak) for peak in _peaks(spectrum)]
    # Rows run along -B.
    waves = [(-ky / level.size_m[0], kx / level.size_m[1]) for ky, kx in peaks]
    return [1 / math.hypot(*wave) for wave in waves], [_angle_deg(*wave) for wave in waves]


def _angle_deg(q_b: float, q_t: float) -> float:
    """Angle of a grating vector, which has no sign: in (-90, 90]."""
    angle = math.degrees(math.atan2(q_b, q_t))
    return (angle if -90 < angle <= 90 else angle - math.copysign(180, angle)) + 0.0  # no negative zero


def _spectrum(level: HeightMap) -> _Spectrum:
    """Power of the heights under a Hann window: the scan's bare edges would make a cross of false periods."""
    window_y, window_x = (np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2 for n in level.height_m.shape)
    windowed = fill_missing(level).height_m * window_y[:, None] * window_x
    transform = np.fft.rfft2(windowed)
    amplitude = np.abs(transform) * (2 / (window_y.sum() * window_x.sum()))
    return _Spectrum(amplitude**2, level.size_m)


def _peaks(spectrum: _Spectrum) -> list[tuple[int, int]]:
    """Bins (ky, kx) of the distinct peaks of q x power, strongest first.

    The weight makes it the power per relative bandwidth: the power of the slow waves of natural surfaces,
    which falls at least as 1/q^2, no longer drowns the grating, and yet a fundamental stays above its
    harmonics, whose power falls as 1/m^2 in the worst case, that of a blazed or binary profile (slopes, q^2,
    would level them).
    """
    ky, kx, power = spectrum.ky, spectrum.kx, spectrum.power
    strength = np.hypot(ky / spectrum.size_m[0], kx / spectrum.size_m[1]) * power
    faintest = _ABOVE_MEDIAN * float(np.median(strength))
    strength[~_is_summit(power) | (np.hypot(ky, kx) < _LEAST_REPEATS)] = 0.0
    faintest = max(faintest, _FAINTEST_SHARE * float(strength.max()))
    found: list[tuple[int, int]] = []
    while len(found) < _MOST_PERIODS:
        row, col = np.unravel_index(np.argmax(strength), strength.shape)
        if strength[row, col] <= faintest or power[row, col] < _FAINTEST_AMPLITUDE_M**2:
            break
        peak = int(ky[row, 0]), int(kx[col])
        found.append(peak)
        reach = max(_DISTINCT_BINS, _DISTINCT_SHARE * math.hypot(*peak))
        for sign in (1, -1):
            strength[np.hypot(ky - sign * peak[0], kx - sign * peak[1]) <= reach] = 0.0
    return found


def _is_summit(power: np.ndarray) -> np.ndarray:
    """Where no neighbour is higher: the flank of the slow waves, cut off at the least repeats, is no peak."""
    summit = (power >= np.roll(power, 1, axis=0)) & (power >= np.roll(power, -1, axis=0))
    summit[:, 1:] &= power[:, 1:] >= power[:, :-1]
    summit[:, :-1] &= power[:, :-1] >= power[:, 1:]
    return summit


def _refine(spectrum: _Spectrum, cols: int, ky: int, kx: int) -> tuple[float, float]:
    """The peak between the bins: the vertex of a parabola through three logarithms of power, per axis."""
    centre = spectrum.at(ky, kx, cols)
    return (
        ky + _vertex(spectrum.at(ky - 1, kx, cols), centre, spectrum.at(ky + 1, kx, cols)),
        kx + _vertex(spectrum.at(ky, kx - 1, cols), centre, spectrum.at(ky, kx + 1, cols)),
    )


def _vertex(below: float, centre: float, above: float) -> float:
    tiny = 1e-12 * centre
    a, b, c = (math.log(value + tiny) for value in (below, centre, above))
    bend = a - 2 * b + c
    return min(0.5, max(-0.5, (a - c) / (2 * bend))) if bend < 0 else 0.0
