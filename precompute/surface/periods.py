# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the periods of a relief, as peaks of its power spectrum, and which of them diffract visibly."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from .first_order import COARSEST_PERIOD_M, FINEST_PERIOD_M, visible_share
from .height_map import HeightMap
from .height_spectrum import Spectrum, ground_of, refined, spectrum_of
from .line_noise import line_noise
from .other_way import confirms

_MOST_PERIODS = 5
# Of a larger scan only the middle, of this many pixels a side, is examined: 2 s instead of minutes.
_SIDE_MAX = 2048
# A period must fit at least three times into the scan.
_LEAST_REPEATS = 3.0
# Peaks closer than the window's main lobe (4 bins wide), or than the spread of a natural surface's peak (15 % to either
# side on a real Elaphe scan), count as one.
_DISTINCT_BINS = 4.0
_DISTINCT_SHARE = 0.2
# Peaks below this share of the strongest are ignored.
_FAINTEST_SHARE = 0.05
# The least ratio of a peak to the median power of waves of similar length. Noise power is exponentially distributed:
# the strongest of 10^7 bins has ln(10^7) = 16 times the mean, or 23 times the median. Natural roughness is such noise,
# growing with the wavelength.
_ABOVE_MEDIAN = 50.0
# The same ratio for a wave of two or three times a peak's length. It lies in one of 18 bins; noise reaches this ratio
# in one of them for one in 3,000 peaks.
_FUNDAMENTAL_ABOVE_MEDIAN = 16.0
# The largest measured distance of a harmonic from a multiple of its wave's frequency, in bins.
_HARMONIC_BINS = 1.0
# Line noise fills the lowest horizontal frequencies, which the window's lobe about 0 covers.
_NOISE_COLUMNS = 3
# How often waves that the opposite scan lacks are replaced by the next strongest, five at a time.
_ROUNDS = 8
# A wave below 1 pm is a rounding error.
_FAINTEST_AMPLITUDE_M = 1e-12
# The least visible share of light. Under the sun, which covers 6.8e-5 sr, an order of this efficiency is a hundredth as
# bright as white paper: 0.01 * 6.8e-5 / pi.
_FAINTEST_LIGHT = 2.2e-7
# The contrast of an exact wave, which stands only on rounding errors, is cut to this.
_CONTRAST_MAX = 1e12
# The bins (ky, kx) of peaks.
_Peaks = list[tuple[int, int]]


@dataclass(frozen=True)
class Wave:
    """A wave of the relief.

    angle_deg    direction of the grating vector in degrees: from T, counterclockwise towards B, in (-90, 90]
    repeats      how often the wave fits into the scan along its direction
    amplitude_m  amplitude in metres of a sine with the same peak in the spectrum
    light        share of visible light in the first order of this sine (first_order.py); 0 if it is not visible
    contrast     ratio of the peak to the median power of waves of similar length"""

    period_m: float
    angle_deg: float
    repeats: float
    amplitude_m: float
    light: float
    contrast: float

    def in_words(self) -> str:
        """Format period and direction: "316 nm at 45 deg"."""
        # round() and + 0 avoid a negative zero.
        return f"{length_in_words(self.period_m)} at {round(self.angle_deg) + 0} deg"


def length_in_words(length_m: float) -> str:
    """Format a length in micrometres, or in nanometres below 10 um: "18.4 um", "1501 nm"."""
    # Four digits of a length slightly below 10 um would be 1e+04 nm.
    return f"{length_m * 1e6:.3g} um" if length_m >= 9.9995e-6 else f"{length_m * 1e9:.4g} nm"


@dataclass(frozen=True)
class Waves:
    """The waves of a relief.

    gratings  at most five that diffract visibly, brightest first
    waviness  the highest wave that is too coarse to show colours, or None
    fine      the highest wave that is too fine for visible light, or None
    noise     the strongest wave rejected as possible line noise, or None
    one_way   whether the opposite scan lacks `noise` (other_way.py); else it resembles random shifts (line_noise.py)"""

    gratings: tuple[Wave, ...]
    waviness: Wave | None
    fine: Wave | None
    noise: Wave | None = None
    one_way: bool = False


def waves_of(
    level: HeightMap,
    scan_m: tuple[float, float] | None = None,
    *,
    other: Callable[[], HeightMap | None] | None = None,
) -> Waves:
    """Find the waves of levelled heights, in the middle of a large scan; holes are filled first.

    `scan_m` (Ly, Lx) are the whole scan's sides in metres, if `level` is a part. `other` returns the same part of the
    opposite scan, levelled alike, or None. It is called only if a wave may be a grating; a grating must be in both.

    A wave diffracts visibly if it has a first order in visible light (FINEST_PERIOD_M) whose colours separate under the
    sun (COARSEST_PERIOD_M). Gratings are ordered by the light in this order. Power alone would favour slow waves of
    natural surfaces; power times frequency would favour fine waves with orders at grazing angles only."""
    scan_m = scan_m or level.size_m
    middle = replace(level, height_m=level.height_m[middle_of(level)])
    spectrum = spectrum_of(middle)
    q, power = spectrum.q, spectrum.power
    ground = ground_of(power, q)
    stands_out = power > _ABOVE_MEDIAN * ground
    light = visible_share(q) * power
    coarse, fine = np.where(q < 1 / COARSEST_PERIOD_M, power, 0.0), np.where(q > 1 / FINEST_PERIOD_M, power, 0.0)
    waviness = _peaks(spectrum, coarse, 1, least=_FAINTEST_AMPLITUDE_M**2)
    # A synthetic surface has no line noise.
    known = None if level.periodic else waviness

    def find() -> tuple[_Peaks, _Peaks]:
        found, chance = _diffracting(spectrum, np.where(stands_out, light, 0.0), known)
        return _with_fundamentals(spectrum, found, light, ground), chance

    gratings, noise = find()
    missing: _Peaks = []
    way_back = other() if gratings and other is not None else None
    if way_back is not None:
        is_shown = confirms(middle, spectrum, way_back)
        for _ in range(_ROUNDS):
            lacking = [peak for peak in gratings if not is_shown(peak)]
            if not lacking:
                break
            missing += lacking
            for ky, kx in lacking:
                # The frequencies (ky, 0) and (-ky, 0) are one wave.
                light[[ky, ky if kx else -ky], kx] = 0.0
            gratings, noise = find()
        gratings = list(filter(is_shown, gratings))
        noise = missing[:1] or noise
    fine[~stands_out] = 0.0
    if any(kx < _NOISE_COLUMNS for _, kx in noise):
        fine[:, :_NOISE_COLUMNS] = 0.0
    others = waviness, _peaks(spectrum, fine, 1, least=_FAINTEST_AMPLITUDE_M**2), noise

    def wave(peak: tuple[int, int]) -> Wave:
        return _wave(spectrum, peak, scan_m=scan_m, ground=ground[peak])

    coarsest, finest, chance = (wave(peaks[0]) if peaks else None for peaks in others)
    return Waves(tuple(map(wave, gratings)), coarsest, finest, chance, one_way=bool(missing))


def _diffracting(
    spectrum: Spectrum, light: np.ndarray, waviness: list[tuple[int, int]] | None
) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """Find the gratings by their light (ny, nx), and the strongest peak that may be line noise, unless a grating has
    lines along the scan lines too. `waviness` is as in line_noise, or None if the surface has no line noise."""
    found = _peaks(spectrum, light.copy(), _MOST_PERIODS, least=_FAINTEST_LIGHT)
    noise = [] if waviness is None else line_noise(spectrum, found, waviness)
    if not noise:
        return found, []
    # Noise has peaks at all vertical frequencies, which must not push gratings out of the list.
    along = [peak for peak in found if peak not in noise and peak[1] < _NOISE_COLUMNS]
    beyond = light.copy()
    beyond[:, :_NOISE_COLUMNS] = 0.0
    for peak in along:
        beyond[peak] = light[peak]
    return _peaks(spectrum, beyond, _MOST_PERIODS, least=_FAINTEST_LIGHT), [] if along else noise[:1]


def _with_fundamentals(
    spectrum: Spectrum, peaks: list[tuple[int, int]], light: np.ndarray, ground: np.ndarray
) -> list[tuple[int, int]]:
    """Add the brighter waves of two and three times the peaks' lengths.

    A disc's pits scatter light at all lengths about its track pitch, and much less at half of it, so only the harmonic
    stands out. A fundamental may stand out less than other peaks, since only a few bins are searched for it."""
    found = list(peaks)
    for peak in peaks:
        for fraction in (2, 3):
            fast = refined(spectrum, peak)
            slow = _highest_near(spectrum, (fast[0] / fraction, fast[1] / fraction))
            off = math.dist([fraction * each for each in refined(spectrum, slow)], fast)
            if (
                off <= _HARMONIC_BINS
                and math.hypot(*slow) >= _LEAST_REPEATS
                and spectrum.power[slow] > _FUNDAMENTAL_ABOVE_MEDIAN * ground[slow]
                and light[slow] > light[peak]
                and _is_alone(slow, [each for each in found if each != peak])
            ):
                found.append(slow)
    found.sort(key=lambda each: -light[each])
    return [each for each in found if light[each] > _FAINTEST_SHARE * light[found[0]]][:_MOST_PERIODS]


def _is_alone(peak: tuple[int, int], others: list[tuple[int, int]]) -> bool:
    """Whether a peak is distinct from others by the rule of _peaks."""
    reach = max(_DISTINCT_BINS, _DISTINCT_SHARE * math.hypot(*peak))
    return all(math.hypot(peak[0] - sign * ky, peak[1] - sign * kx) > reach for ky, kx in others for sign in (1, -1))


def _highest_near(spectrum: Spectrum, place: tuple[float, float]) -> tuple[int, int]:
    """Return the bin of the highest power next to a place (ky, kx) of the spectrum."""
    ky, kx = (round(each) for each in place)
    near = [(ky + dy, kx + dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if kx + dx >= 0]
    return max(near, key=lambda each: spectrum.at(*each))


def _wave(spectrum: Spectrum, peak: tuple[int, int], *, scan_m: tuple[float, float], ground: float) -> Wave:
    """Measure the wave of a peak; `scan_m` as in waves_of, `ground` the median power of waves of similar length."""
    ky, kx = refined(spectrum, peak)
    # The row index runs along -B.
    q_b, q_t = -ky / spectrum.size_m[0], kx / spectrum.size_m[1]
    q, power = math.hypot(q_b, q_t), spectrum.at(*peak)
    return Wave(
        period_m=1 / q,
        angle_deg=_angle_deg(q_b, q_t),
        repeats=math.hypot(q_b * scan_m[0], q_t * scan_m[1]),
        amplitude_m=math.sqrt(power),
        light=float(visible_share(np.array(q))) * power,
        contrast=float(min(power / ground, _CONTRAST_MAX)) if ground else _CONTRAST_MAX,
    )


def middle_of(scan: HeightMap) -> tuple[slice, slice]:
    """Return the rows and columns of the middle, at most _SIDE_MAX each; of the whole scan if its middle is missing."""
    starts = [max(0, (n - _SIDE_MAX) // 2) for n in scan.height_m.shape]
    middle = slice(starts[0], starts[0] + _SIDE_MAX), slice(starts[1], starts[1] + _SIDE_MAX)
    return (slice(None), slice(None)) if np.isnan(scan.height_m[middle]).all() else middle


def _angle_deg(q_b: float, q_t: float) -> float:
    """Return a grating vector's angle in degrees, in (-90, 90], since opposite vectors are one grating."""
    angle = math.degrees(math.atan2(q_b, q_t))
    return (angle if -90 < angle <= 90 else angle - math.copysign(180, angle)) + 0.0  # no negative zero


def _peaks(spectrum: Spectrum, strength: np.ndarray, most: int, *, least: float) -> list[tuple[int, int]]:
    """Find the bins (ky, kx) of at most `most` distinct peaks of the power, strongest first.

    Peaks with a strength below `least`, or below _FAINTEST_SHARE of the greatest, are ignored. Changes `strength`."""
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
    """Set the strength (ny, nx) to 0 within `reach` bins of the frequencies `centre`."""
    ky = np.round(np.fft.fftfreq(len(strength)) * len(strength))
    rows = np.nonzero(np.abs(ky - centre[0]) <= reach)[0]
    cols = slice(max(0, math.ceil(centre[1] - reach)), max(0, math.floor(centre[1] + reach) + 1))
    near = strength[rows, cols]
    far = np.hypot(ky[rows, None] - centre[0], np.arange(strength.shape[1])[cols] - centre[1]) > reach
    strength[rows, cols] = np.where(far, near, 0.0)


def _is_summit(power: np.ndarray) -> np.ndarray:
    """Whether each bin (ny, nx) has at least the power of its four neighbours.

    Without this test the flanks of the ignored slow waves would count as peaks."""
    summit = (power >= np.roll(power, 1, axis=0)) & (power >= np.roll(power, -1, axis=0))
    summit[:, 1:] &= power[:, 1:] >= power[:, :-1]
    summit[:, :-1] &= power[:, :-1] >= power[:, 1:]
    return summit
