# SPDX-License-Identifier: GPL-3.0-or-later
"""The periods of a relief, found as peaks of its power spectrum: those that diffract visibly, and those that do not."""

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
# A wave whose half or third is a peak is at one of 18 places near there. Noise reaches this multiple of its median at
# one of them once in 3,000 peaks.
_FUNDAMENTAL_ABOVE_MEDIAN = 16.0
# How far a harmonic of a regular grating may be off a multiple of its wave's frequency, as both are measured.
_HARMONIC_BINS = 1.0
# Line noise is in the columns of the spectrum that the window's lobe about the frequency 0 along the rows covers.
_NOISE_COLUMNS = 3
# How often waves that the other way lacks are left out and the next ones found, five at a time.
_ROUNDS = 8
# A wave of less than 1 pm is rounding error, not relief.
_FAINTEST_AMPLITUDE_M = 1e-12
# The least share of light that shows. Under the sun, which fills 6.8e-5 sr, an order of this efficiency is a hundredth
# as bright as white paper: 0.01 * 6.8e-5 / pi.
_FAINTEST_LIGHT = 2.2e-7
# A contrast beyond this is that of an exact wave on nothing but rounding errors.
_CONTRAST_MAX = 1e12
# The bins (ky, kx) of peaks.
_Peaks = list[tuple[int, int]]


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
    fine      the highest wave that is too fine for visible light, None where there is none
    noise     the strongest wave that is left out of the gratings because it is, or may be, line noise of the
              microscope, None where there is none
    one_way   whether `noise` is a wave that the other way over the lines lacks (other_way.py); else it is one of those
              that lines that shift at random have too (line_noise.py)"""

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
    """The waves of levelled heights, of their middle where the scan is large; holes are filled first.

    Where `level` is a part of a scan, scan_m (Ly, Lx) are the scan's sides, in which repeats are counted. `other` gives
    the same part as scanned on the other way over the lines, levelled alike, or None; it is called only if a wave is
    taken for a grating, and a grating must be in both.

    A wave that diffracts visibly is one that visible light leaves at an angle of its own (FINEST_PERIOD_M), with its
    colours so far apart that they can be told apart under the sun (COARSEST_PERIOD_M). Such waves are ordered by the
    light that they send out. Power alone would put the slow waves of natural surfaces first, and power times frequency
    would put fine waves first whose order leaves at grazing angles only, if at all."""
    scan_m = scan_m or level.size_m
    middle = replace(level, height_m=level.height_m[middle_of(level)])
    spectrum = spectrum_of(middle)
    q, power = spectrum.q, spectrum.power
    ground = ground_of(power, q)
    stands_out = power > _ABOVE_MEDIAN * ground
    light = visible_share(q) * power
    coarse, fine = np.where(q < 1 / COARSEST_PERIOD_M, power, 0.0), np.where(q > 1 / FINEST_PERIOD_M, power, 0.0)
    waviness = _peaks(spectrum, coarse, 1, least=_FAINTEST_AMPLITUDE_M**2)
    # A surface that was made has no noise of a microscope.
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
    """The peaks of the light (ny, nx) of waves that stand out: those of gratings, and the strongest that may be line
    noise, if there is one and no grating runs along the rows as it does.

    `waviness` is the peak of a slower wave, whose harmonics the gratings may be; None where there is no line noise."""
    found = _peaks(spectrum, light.copy(), _MOST_PERIODS, least=_FAINTEST_LIGHT)
    noise = [] if waviness is None else line_noise(spectrum, found, waviness)
    if not noise:
        return found, []
    # The noise has peaks at all row frequencies, which must not push gratings out of the list.
    along = [peak for peak in found if peak not in noise and peak[1] < _NOISE_COLUMNS]
    beyond = light.copy()
    beyond[:, :_NOISE_COLUMNS] = 0.0
    for peak in along:
        beyond[peak] = light[peak]
    return _peaks(spectrum, beyond, _MOST_PERIODS, least=_FAINTEST_LIGHT), [] if along else noise[:1]


def _with_fundamentals(
    spectrum: Spectrum, peaks: list[tuple[int, int]], light: np.ndarray, ground: np.ndarray
) -> list[tuple[int, int]]:
    """The peaks, and the waves of two and three times their lengths that send out more light than they do.

    Pits of random lengths in tracks scatter light at all lengths about that of the tracks, and much less at half of it:
    there the harmonic stands out of all waves, and the tracks' own wave does not. What lies at a fraction of another
    peak's frequency needs to stand out less: it is one of a few places, and not one of all."""
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
    """Whether a peak is distinct from others, as _peaks takes it."""
    reach = max(_DISTINCT_BINS, _DISTINCT_SHARE * math.hypot(*peak))
    return all(math.hypot(peak[0] - sign * ky, peak[1] - sign * kx) > reach for ky, kx in others for sign in (1, -1))


def _highest_near(spectrum: Spectrum, place: tuple[float, float]) -> tuple[int, int]:
    """The bin of the highest power next to a place (ky, kx) of the spectrum."""
    ky, kx = (round(each) for each in place)
    near = [(ky + dy, kx + dx) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if kx + dx >= 0]
    return max(near, key=lambda each: spectrum.at(*each))


def _wave(spectrum: Spectrum, peak: tuple[int, int], *, scan_m: tuple[float, float], ground: float) -> Wave:
    """The wave of a peak (ky, kx) of the spectrum of heights, which are the middle of a scan of sides scan_m (Ly, Lx);
    `ground` is the median power of waves of about its length."""
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
    """The rows and columns of the middle, at most _SIDE_MAX pixels a side; of a scan whose middle was not measured, all
    of them."""
    starts = [max(0, (n - _SIDE_MAX) // 2) for n in scan.height_m.shape]
    middle = slice(starts[0], starts[0] + _SIDE_MAX), slice(starts[1], starts[1] + _SIDE_MAX)
    return (slice(None), slice(None)) if np.isnan(scan.height_m[middle]).all() else middle


def _angle_deg(q_b: float, q_t: float) -> float:
    """The angle of a grating vector (B, T) in degrees, in (-90, 90], as opposite vectors are one grating."""
    angle = math.degrees(math.atan2(q_b, q_t))
    return (angle if -90 < angle <= 90 else angle - math.copysign(180, angle)) + 0.0  # no negative zero


def _peaks(spectrum: Spectrum, strength: np.ndarray, most: int, *, least: float) -> list[tuple[int, int]]:
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


def _is_summit(power: np.ndarray) -> np.ndarray:
    """Whether each bin (ny, nx) has at least as much power as each of its four neighbours.

    Waves that repeat fewer than three times in the scan are left out. The flank of their power reaches higher
    frequencies and would count as a peak without this test."""
    summit = (power >= np.roll(power, 1, axis=0)) & (power >= np.roll(power, -1, axis=0))
    summit[:, 1:] &= power[:, 1:] >= power[:, :-1]
    summit[:, :-1] &= power[:, :-1] >= power[:, 1:]
    return summit
