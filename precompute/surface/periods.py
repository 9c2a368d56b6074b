# SPDX-License-Identifier: GPL-3.0-or-later
"""The periods of a relief, found as peaks of its power spectrum."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .height_map import HeightMap
from .holes import fill_missing

_MOST_PERIODS = 5
# A period fits at least three times into the scan; longer waves are waviness.
_LEAST_REPEATS = 3.0
# Two peaks are one if they are nearer to each other than the main lobe of the window (4 bins wide), or than the spread
# of a natural surface's peak (15 % to either side on a real Elaphe scan).
_DISTINCT_BINS = 4.0
_DISTINCT_SHARE = 0.2
# Peaks below this share of the strongest are left out.
_FAINTEST_SHARE = 0.05
# Peaks below this multiple of the median strength are noise. The power of white noise is exponentially distributed: the
# strongest of 10^7 bins has ln(10^7) = 16 times the mean power, or 23 times the median power. At the corner of the band
# the weight q is greatest and doubles this ratio (56 was seen). The peaks of gratings reach 10^5.
_ABOVE_MEDIAN = 100.0
# A wave of less than 1 pm is rounding error, not relief.
_FAINTEST_AMPLITUDE_M = 1e-12


@dataclass(frozen=True)
class _Spectrum:
    """The power spectrum of windowed heights.

    power   (ny, nx) in square metres; a sine of amplitude a has a peak of about a^2. Rows are the vertical frequencies
            in the order of np.fft.fftfreq, columns the horizontal frequencies from 0 up, both in cycles per scan
    size_m  (Ly, Lx), the sides of the scan in metres
    """

    power: np.ndarray
    size_m: tuple[float, float]

    @property
    def ky(self) -> np.ndarray:
        """Vertical frequency of each row (ny, 1), whole cycles per scan."""
        return np.round(np.fft.fftfreq(len(self.power)) * len(self.power))[:, None]

    @property
    def kx(self) -> np.ndarray:
        """Horizontal frequency of each column (nx,), whole cycles per scan."""
        return np.arange(self.power.shape[1])

    def at(self, ky: int, kx: int, cols: int) -> float:
        """The power at any pair of whole frequencies, in cycles per scan; `cols` is the number of columns of the
        heights.

        The array holds half of the frequencies. The others follow because the spectrum of real heights is even and
        periodic."""
        kx = (kx + cols // 2) % cols - cols // 2
        ky, kx = (ky, kx) if kx >= 0 else (-ky, -kx)
        return float(self.power[ky % len(self.power), kx])


def strongest_periods(level: HeightMap) -> tuple[list[float], list[float]]:
    """The strongest periods of levelled heights: at most five, the strongest first.

    Returns the periods in metres, and the direction of each period's grating vector in degrees: from T,
    counterclockwise towards B, in (-90, 90]. Both are empty where nothing repeats. Holes are filled first."""
    spectrum = _spectrum(level)
    peaks = [_refine(spectrum, level.cols, peak) for peak in _peaks(spectrum)]
    # The row index runs along -B.
    waves = [(-ky / level.size_m[0], kx / level.size_m[1]) for ky, kx in peaks]
    return [1 / math.hypot(*wave) for wave in waves], [_angle_deg(*wave) for wave in waves]


def _angle_deg(q_b: float, q_t: float) -> float:
    """The angle of a grating vector (B, T) in degrees, in (-90, 90], as opposite vectors are one grating."""
    angle = math.degrees(math.atan2(q_b, q_t))
    return (angle if -90 < angle <= 90 else angle - math.copysign(180, angle)) + 0.0  # no negative zero


def _spectrum(level: HeightMap) -> _Spectrum:
    """The spectrum of the heights under a Hann window; without a window the scan's edges would add a cross of false
    peaks."""
    window_y, window_x = (np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2 for n in level.height_m.shape)
    windowed = fill_missing(level).height_m * window_y[:, None] * window_x
    transform = np.fft.rfft2(windowed)
    amplitude = np.abs(transform) * (2 / (window_y.sum() * window_x.sum()))
    return _Spectrum(amplitude**2, level.size_m)


def _peaks(spectrum: _Spectrum) -> list[tuple[int, int]]:
    """The bins (ky, kx) of distinct peaks, ordered by frequency times power, the strongest first.

    Power alone would put the slow waves of natural surfaces first; their power falls at least as 1 / q^2. The weight q
    puts the grating before them. It still keeps a fundamental before its harmonics, whose power falls as 1 / m^2 in
    the worst case, a blazed or a binary profile. A weight q^2, the power of slopes, would make these all equal.
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
    """Whether each bin (ny, nx) has at least as much power as each of its four neighbours.

    Waves that repeat fewer than three times in the scan are left out. The flank of their power reaches higher
    frequencies and would count as a peak without this test."""
    summit = (power >= np.roll(power, 1, axis=0)) & (power >= np.roll(power, -1, axis=0))
    summit[:, 1:] &= power[:, 1:] >= power[:, :-1]
    summit[:, :-1] &= power[:, :-1] >= power[:, 1:]
    return summit


def _refine(spectrum: _Spectrum, cols: int, peak: tuple[int, int]) -> tuple[float, float]:
    """The frequencies (ky, kx) of a peak between the bins, from a parabola through log power along each axis."""
    ky, kx = peak
    centre = spectrum.at(ky, kx, cols)
    return (
        ky + _vertex(spectrum.at(ky - 1, kx, cols), centre, spectrum.at(ky + 1, kx, cols)),
        kx + _vertex(spectrum.at(ky, kx - 1, cols), centre, spectrum.at(ky, kx + 1, cols)),
    )


def _vertex(below: float, centre: float, above: float) -> float:
    """Offset in bins, from -0.5 to 0.5, of the top of the parabola through the logarithms of three powers."""
    tiny = 1e-12 * centre
    a, b, c = (math.log(value + tiny) for value in (below, centre, above))
    bend = a - 2 * b + c
    return min(0.5, max(-0.5, (a - c) / (2 * bend))) if bend < 0 else 0.0
