# SPDX-License-Identifier: GPL-3.0-or-later
"""The periods of a relief, found as peaks of its power spectrum: those that diffract visibly, and those that do not."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from .first_order import COARSEST_PERIOD_M, FINEST_PERIOD_M, visible_share
from .height_map import HeightMap
from .holes import fill_missing

_MOST_PERIODS = 5
# Of a larger scan the middle is looked at, of this many pixels a side: 2 s of work instead of minutes.
_SIDE_MAX = 2048
# A period fits at least three times into the scan.
_LEAST_REPEATS = 3.0
# Two peaks are one if they are nearer to each other than the main lobe of the window (4 bins wide), or than the spread
# of a natural surface's peak (15 % to either side on a real Elaphe scan).
_DISTINCT_BINS = 4.0
_DISTINCT_SHARE = 0.2
# Peaks below this share of the strongest are left out.
_FAINTEST_SHARE = 0.05
# A peak must have this multiple of the median power of all waves of about its own length. The power of noise is
# exponentially distributed: the strongest of 10^7 bins has ln(10^7) = 16 times the mean power, or 23 times the median.
# The roughness of natural surfaces is such noise at each length, and grows with the length.
_ABOVE_MEDIAN = 50.0
# The longest waves are compared with this many of each other, several times as many as the window's lobe covers.
_FEWEST_COMPARED = 96
# A wave of less than 1 pm is rounding error, not relief.
_FAINTEST_AMPLITUDE_M = 1e-12
# The least share of light that shows. Under the sun, which fills 6.8e-5 sr, an order of this efficiency is a hundredth
# as bright as white paper: 0.01 * 6.8e-5 / pi.
_FAINTEST_LIGHT = 2.2e-7
# A contrast beyond this is that of an exact wave on nothing but rounding errors.
_CONTRAST_MAX = 1e12


@dataclass(frozen=True)
class Wave:
    """A wave of the relief.

    period_m         its length in metres
    angle_deg        direction of its grating vector in degrees: from T, counterclockwise towards B, in (-90, 90]
    repeats          how many times it fits into the scan along that direction
    amplitude_m      the amplitude of a sine with as high a peak in the spectrum, in metres
    light            the share of visible light that the first order of this sine sends out (first_order.py); 0
                     for a wave that does not diffract visibly
    contrast         how many times its peak is as high as the median power of waves of about its length"""

    period_m: float
    angle_deg: float
    repeats: float
    amplitude_m: float
    light: float
    contrast: float

    def in_words(self) -> str:
        """Length and direction: "316 nm at 45 deg"."""
        # round() and + 0 keep a minus off zero.
        return f"{length_in_words(self.period_m)} at {round(self.angle_deg) + 0} deg"


def length_in_words(length_m: float) -> str:
    """A length in micrometres or, below ten of them, in nanometres: "18.4 um", "1501 nm"."""
    return f"{length_m * 1e6:.3g} um" if length_m >= 10e-6 else f"{length_m * 1e9:.4g} nm"


@dataclass(frozen=True)
class Waves:
    """The waves of a relief.

    gratings  at most five that diffract visibly, the one that sends out the most light first
    waviness  the highest wave that is too coarse to show colours, None where there is none
    fine      the highest wave that is too fine for visible light, None where there is none"""

    gratings: tuple[Wave, ...]
    waviness: Wave | None
    fine: Wave | None


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

    @property
    def q(self) -> np.ndarray:
        """Frequency of each bin (ny, nx), cycles per metre."""
        return np.hypot(self.ky / self.size_m[0], self.kx / self.size_m[1])

    def at(self, ky: int, kx: int, cols: int) -> float:
        """The power at any pair of whole frequencies, in cycles per scan; `cols` is the number of columns of the
        heights.

        The array holds half of the frequencies. The others follow because the spectrum of real heights is even and
        periodic."""
        kx = (kx + cols // 2) % cols - cols // 2
        ky, kx = (ky, kx) if kx >= 0 else (-ky, -kx)
        return float(self.power[ky % len(self.power), kx])


def waves_of(level: HeightMap, scan_m: tuple[float, float] | None = None) -> Waves:
    """The waves of levelled heights, of their middle where the scan is large; holes are filled first.

    Where `level` is a part of a scan, scan_m (Ly, Lx) are the scan's sides, in which repeats are counted.

    A wave that diffracts visibly is one that visible light leaves at an angle of its own (FINEST_PERIOD_M), with its
    colours so far apart that they can be told apart under the sun (COARSEST_PERIOD_M). Such waves are ordered by the
    light that they send out. Power alone would put the slow waves of natural surfaces first, and power times frequency
    would put fine waves first whose order leaves at grazing angles only, if at all."""
    scan_m = scan_m or level.size_m
    middle = replace(level, height_m=level.height_m[middle_of(level)])
    spectrum = _spectrum(middle)
    q, power = spectrum.q, spectrum.power
    ground = _ground(power, q)
    stands_out = power > _ABOVE_MEDIAN * ground
    light = np.where(stands_out, visible_share(q) * power, 0.0)
    waviness = np.where(q < 1 / COARSEST_PERIOD_M, power, 0.0)
    fine = np.where(stands_out & (q > 1 / FINEST_PERIOD_M), power, 0.0)
    gratings = _peaks(spectrum, light, _MOST_PERIODS, least=_FAINTEST_LIGHT)
    others = [_peaks(spectrum, each, 1, least=_FAINTEST_AMPLITUDE_M**2) for each in (waviness, fine)]

    def wave(peak: tuple[int, int]) -> Wave:
        return _wave(spectrum, middle.cols, peak, scan_m=scan_m, ground=ground[peak])

    return Waves(tuple(map(wave, gratings)), *(wave(peaks[0]) if peaks else None for peaks in others))


def _wave(spectrum: _Spectrum, cols: int, peak: tuple[int, int], *, scan_m: tuple[float, float], ground: float) -> Wave:
    """The wave of a peak (ky, kx) of the spectrum of heights of `cols` columns, which are the middle of a scan of sides
    scan_m (Ly, Lx); `ground` is the median power of waves of about its length."""
    ky, kx = _refine(spectrum, cols, peak)
    # The row index runs along -B.
    q_b, q_t = -ky / spectrum.size_m[0], kx / spectrum.size_m[1]
    q, power = math.hypot(q_b, q_t), spectrum.at(*peak, cols)
    return Wave(
        period_m=1 / q,
        angle_deg=_angle_deg(q_b, q_t),
        repeats=math.hypot(q_b * scan_m[0], q_t * scan_m[1]),
        amplitude_m=math.sqrt(power),
        light=float(visible_share(np.array(q))) * power,
        contrast=float(min(power / ground, _CONTRAST_MAX)) if ground else _CONTRAST_MAX,
    )


def middle_of(scan: HeightMap) -> tuple[slice, slice]:
    """The rows and columns of the middle, at most _SIDE_MAX pixels a side; of a scan whose middle was not measured, all
    of them."""
    starts = [max(0, (n - _SIDE_MAX) // 2) for n in scan.height_m.shape]
    middle = slice(starts[0], starts[0] + _SIDE_MAX), slice(starts[1], starts[1] + _SIDE_MAX)
    return (slice(None), slice(None)) if np.isnan(scan.height_m[middle]).all() else middle


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
    return _Spectrum(np.ascontiguousarray(amplitude**2), level.size_m)


def _peaks(spectrum: _Spectrum, strength: np.ndarray, most: int, *, least: float) -> list[tuple[int, int]]:
    """The bins (ky, kx) of at most `most` distinct peaks of the power, those of the greatest strength first.

    strength (ny, nx) is changed. Peaks of a strength below `least` are left out, and those below _FAINTEST_SHARE of the
    greatest."""
    ky, kx = spectrum.ky, spectrum.kx
    strength[~_is_summit(spectrum.power)] = 0.0
    _clear(strength, (0, 0), np.nextafter(_LEAST_REPEATS, 0))
    faintest = max(least, _FAINTEST_SHARE * float(strength.max()))
    found: list[tuple[int, int]] = []
    while len(found) < most:
        row, col = np.unravel_index(np.argmax(strength), strength.shape)
        if strength[row, col] <= faintest:
            break
        peak = int(ky[row, 0]), int(kx[col])
        found.append(peak)
        reach = max(_DISTINCT_BINS, _DISTINCT_SHARE * math.hypot(*peak))
        for sign in (1, -1):
            _clear(strength, (sign * peak[0], sign * peak[1]), reach)
    return found


def _clear(strength: np.ndarray, centre: tuple[int, int], reach: float) -> None:
    """Set a strength (ny, nx), as of _peaks, to 0 up to a distance of `reach` from a pair of frequencies."""
    ky = np.round(np.fft.fftfreq(len(strength)) * len(strength))
    rows = np.nonzero(np.abs(ky - centre[0]) <= reach)[0]
    cols = slice(max(0, math.ceil(centre[1] - reach)), max(0, math.floor(centre[1] + reach) + 1))
    near = strength[rows, cols]
    far = np.hypot(ky[rows, None] - centre[0], np.arange(strength.shape[1])[cols] - centre[1]) > reach
    strength[rows, cols] = np.where(far, near, 0.0)


def _ground(power: np.ndarray, q: np.ndarray) -> np.ndarray:
    """For each bin (ny, nx) the median power of all waves of about its own length.

    q (ny, nx) is the frequency of each bin."""
    power = power.ravel()
    ground = np.zeros(power.size)
    by_length = np.argsort(q, axis=None)
    start, stop = 0, _FEWEST_COMPARED
    while start < power.size:
        # Each group has as many waves as all coarser ones together: in two dimensions it is half an octave wide.
        group = by_length[start:stop]
        ground[group] = np.median(power[group])
        start, stop = stop, 2 * stop
    return ground.reshape(q.shape)


def _is_summit(power: np.ndarray) -> np.ndarray:
    """Whether each bin (ny, nx) has at least as much power as each of its four neighbours.

    Waves that repeat fewer than three times in the scan are left out. The flank of their power reaches higher
    frequencies and would count as a peak without this test."""
    summit = (power >= np.roll(power, 1, axis=0)) & (power >= np.roll(power, -1, axis=0))
    summit[:, 1:] &= power[:, 1:] >= power[:, :-1]
    summit[:, :-1] &= power[:, :-1] >= power[:, 1:]
    return summit


def _refine(spectrum: _Spectrum, cols: int, peak: tuple[int, int]) -> tuple[float, float]:
    """The frequencies (ky, kx) of a peak between the bins, as if it were one wave's."""
    ky, kx = peak
    centre = spectrum.at(ky, kx, cols)
    return (
        ky + _between(spectrum.at(ky - 1, kx, cols), centre, spectrum.at(ky + 1, kx, cols)),
        kx + _between(spectrum.at(ky, kx - 1, cols), centre, spectrum.at(ky, kx + 1, cols)),
    )


def _between(below: float, centre: float, above: float) -> float:
    """Offset in bins, from -0.5 to 0.5, of a wave's frequency from the bin of the peak, from the powers of that bin and
    of its neighbours.

    A wave d bins away has the amplitude sin(pi d) / (pi d (1 - d^2)) under a Hann window, so that of the amplitudes
    a, b, c of three bins 2 (c - a) / (a + 2 b + c) is d (Grandke 1983, by three points)."""
    a, b, c = (math.sqrt(power) for power in (below, centre, above))
    return min(0.5, max(-0.5, 2 * (c - a) / (a + 2 * b + c))) if b else 0.0
