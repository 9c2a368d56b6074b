# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the periods of a relief, as peaks of its power spectrum, and which of them diffract visibly.

A wave of period d sends its first order to sin(tr) = lambda / d - sin(ti). The angles ti of light and tr of view are
measured from the normal, in the plane of the grating vector. For a sine of amplitude a much lower than the wavelength,
the efficiency is J1(2 pi a w / lambda)^2 = (pi a w / lambda)^2, with w = cos(ti) + cos(tr) (Goodman, Introduction to
Fourier Optics, 4.4; docs/theory.md).

A microscope adds line noise: random height shifts between scan lines, which cause false peaks. A shift is constant
along its scan line. So the noise has power at the horizontal frequency 0 and at all vertical frequencies. The highest
of its many random peaks rises far above the rest of the spectrum, like a grating with lines along the scan lines. But a
grating also rises above its neighbours at the horizontal frequency 0. An irregular, natural grating has power beside
its peak instead.

The opposite scan direction confirms waves: trace and retrace share the surface, but not line shifts and hum. Hum that
is a wave (ky, kx) in the trace is (ky, -kx) in the retrace, so a wave's mirror image does not confirm it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from ..colour.observer import WAVELENGTH_MIN_M, spectral_weights, wavelengths
from .height_map import HeightMap, fill_missing

# Bins in the group of the longest waves, several times the bins of the window's main lobe.
_FEWEST_COMPARED = 96


@dataclass(frozen=True)
class Spectrum:
    """The power spectrum of windowed heights.

    power   (ny, nx) in square metres; a sine of amplitude a has a peak of about a^2. ny: vertical frequencies in the
            order of np.fft.fftfreq; nx: horizontal frequencies from 0 up; both in cycles per scan
    size_m  (Ly, Lx), the sides of the scan in metres
    cols    number of columns of the heights"""

    power: np.ndarray
    size_m: tuple[float, float]
    cols: int

    @property
    def ky(self) -> np.ndarray:
        """Vertical frequencies (ny, 1), whole cycles per scan."""
        return np.round(np.fft.fftfreq(len(self.power)) * len(self.power))[:, None]

    @property
    def kx(self) -> np.ndarray:
        """Horizontal frequencies (nx,), whole cycles per scan."""
        return np.arange(self.power.shape[1])

    @property
    def q(self) -> np.ndarray:
        """Frequency of each bin (ny, nx), cycles per metre."""
        return np.hypot(self.ky / self.size_m[0], self.kx / self.size_m[1])

    def at(self, ky: int, kx: int) -> float:
        """Return the power at whole frequencies in cycles per scan; the array holds half of the even spectrum."""
        kx = (kx + self.cols // 2) % self.cols - self.cols // 2
        ky, kx = (ky, kx) if kx >= 0 else (-ky, -kx)
        return float(self.power[ky % len(self.power), kx])


def spectrum_of(level: HeightMap) -> Spectrum:
    """Compute the spectrum under a Hann window, without which the scan's edges add a cross of false peaks."""
    window_y, window_x = (np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2 for n in level.height_m.shape)
    windowed = fill_missing(level).height_m * window_y[:, None] * window_x
    transform = np.fft.rfft2(windowed)
    amplitude = np.abs(transform) * (2 / (window_y.sum() * window_x.sum()))
    return Spectrum(np.ascontiguousarray(amplitude**2), level.size_m, level.cols)


def amplitude_at(height: np.ndarray, cycles: tuple[float, float]) -> complex:
    """Return the Fourier transform of hole-free heights (rows, cols) under a Hann window at (ky, kx) cycles per scan.
    The phase is that at the scan's middle; the magnitude is not normalised."""
    along_y, along_x = (_transformed(*each) for each in zip(height.shape, cycles, strict=True))
    # A product with complex numbers would copy the heights as complex numbers.
    real, imaginary = (height @ np.stack([along_x.real, along_x.imag], axis=1)).T
    return complex(along_y @ real + 1j * (along_y @ imaginary))


def _transformed(count: int, cycles: float) -> np.ndarray:
    """Return a Hann window (count,) times the conjugate of a wave of `cycles` periods."""
    place = (np.arange(count) + 0.5) / count
    return np.sin(np.pi * place) ** 2 * np.exp(-2j * np.pi * cycles * (place - 0.5))


def ground_of(power: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the median power (ny, nx) of the bins of similar frequency, where q (ny, nx) is each bin's frequency."""
    power = power.ravel()
    ground = np.zeros(power.size)
    by_length = np.argsort(q, axis=None)
    start, stop = 0, _FEWEST_COMPARED
    while start < power.size:
        # Each group is as large as all coarser groups together: in two dimensions half an octave wide.
        group = by_length[start:stop]
        ground[group] = np.median(power[group])
        start, stop = stop, 2 * stop
    return ground.reshape(q.shape)


def refined(spectrum: Spectrum, peak: tuple[int, int]) -> tuple[float, float]:
    """Interpolate a peak's frequencies (ky, kx) between the bins, assuming a single wave."""
    ky, kx = peak
    centre = spectrum.at(ky, kx)
    return (
        ky + _between(spectrum.at(ky - 1, kx), centre, spectrum.at(ky + 1, kx)),
        kx + _between(spectrum.at(ky, kx - 1), centre, spectrum.at(ky, kx + 1)),
    )


def _between(below: float, centre: float, above: float) -> float:
    """Return a wave's offset in bins, -0.5 to 0.5, from the peak's bin, by the powers of the bin and its neighbours.

    Under a Hann window a wave d bins away has the amplitude sin(pi d) / (pi d (1 - d^2)). So the amplitudes a, b, c of
    three bins give d = 2 (c - a) / (a + 2 b + c) (Grandke 1983, by three points)."""
    a, b, c = (math.sqrt(power) for power in (below, centre, above))
    return min(0.5, max(-0.5, 2 * (c - a) / (a + 2 * b + c))) if b else 0.0


# A finer period has no first order even at grazing light and view, since lambda / d = sin(ti) + sin(tr) is at most 2.
FINEST_PERIOD_M = WAVELENGTH_MIN_M / 2
# The sun is 0.533 degrees wide. A coarser period separates red and green (the sRGB primaries' dominant wavelengths, 611
# and 549 nm) by less, so the sun's images in all colours overlap to white.
COARSEST_PERIOD_M = (611e-9 - 549e-9) / np.radians(0.533)
_ANGLES = np.radians(np.arange(-89.0, 90.0, 2.0))
_FREQUENCIES = 200


def visible_share(q: np.ndarray) -> np.ndarray:
    """Return the share of visible light (D65, by luminance) in the first order of a low sine of frequency q (...,) in
    cycles per metre, divided by the square of its amplitude in metres.

    It is the cosine-weighted mean over light from all angles in the grating vector's plane; 0 if nothing is visible."""
    known, shares = _known()
    return np.where((q >= known[0]) & (q <= known[-1]), np.interp(q, known, shares), 0.0)


@cache
def _known() -> tuple[np.ndarray, np.ndarray]:
    """Tabulate visible_share at frequencies (n,) from the coarsest to the finest period that diffracts visibly."""
    q = np.linspace(1 / COARSEST_PERIOD_M, 1 / FINEST_PERIOD_M, _FREQUENCIES)
    return q, _shares(q)


def _shares(q: np.ndarray) -> np.ndarray:
    """Compute visible_share at frequencies q (n,)."""
    lambdas = wavelengths(5e-9)
    luminance = spectral_weights(lambdas, "D65")[:, 1]
    total = np.zeros(len(q))
    for lam, weight in zip(lambdas, luminance / luminance.sum(), strict=True):
        sine = lam * q[:, None] - np.sin(_ANGLES)
        w = np.where(np.abs(sine) < 1, np.cos(_ANGLES) + np.sqrt(np.maximum(1 - sine**2, 0)), 0.0)
        total += weight * np.average((np.pi * w / lam) ** 2, axis=1, weights=np.cos(_ANGLES))
    return total


# Noise power is exponentially distributed. The strongest of 500 vertical frequencies has ln(500) = 6.2 times the mean,
# or 22 times the lower quartile. Real skins, their rows of fingers turned along the scan lines, have over 100 times.
_ABOVE_QUARTILE = 50.0
# A peak this many times above the power beside it is constant along the scan lines, unlike irregular ridges.
_ABOVE_SIDES = 50.0
# The bins beside a peak: just outside the window's lobe.
_SIDES = (3, 8)
# The largest apparent horizontal frequency of noise, in bins.
_OFF_MAX = 0.6
# A peak is compared with vertical frequencies from 1 / 1.5 to 1.5 times its own, and at least _BAND_BINS beyond it,
# without its own flanks and the lobes of harmonics.
_BAND, _BAND_BINS, _FLANK, _LOBE = 1.5, 12, 0.2, 2.0
# The least correlation of a grating's profile with itself one period on. White noise of 128 rows has 0 +- 0.13 (rms).
_ALIKE = 0.7
# The harmonics of a grating with fewer lines are so close together that any peak would count as one.
_FEWEST_LINES = 6
# A quartile needs _FEWEST bins; if there are fewer, the range extends to _FAR bins beyond the peak.
_FEWEST, _FAR = 8, 64


def line_noise(
    spectrum: Spectrum, peaks: list[tuple[int, int]], waviness: list[tuple[int, int]]
) -> list[tuple[int, int]]:
    """Select the peaks (ky, kx), given strongest first, that may be line noise.

    Gratings, their harmonics, and harmonics of a slower wave (the peak in `waviness`, if any) are no noise."""
    gratings = [
        _frequency(spectrum, peak) for peak in waviness if _is_along(spectrum, peak) and _repeats(spectrum, peak)
    ]
    noise = []
    for peak in peaks:
        if not _is_along(spectrum, peak):
            continue
        frequency = _frequency(spectrum, peak)
        level = _level(spectrum, [*gratings, frequency], _column(peak))
        if (
            spectrum.at(*peak) >= _ABOVE_QUARTILE * level
            or _is_harmonic(frequency, gratings)
            or _repeats(spectrum, peak)
        ):
            gratings.append(frequency)
        else:
            noise.append(peak)
    return noise


def _frequency(spectrum: Spectrum, peak: tuple[int, int]) -> float:
    """Return the vertical frequency of a peak, in cycles per scan."""
    return abs(refined(spectrum, peak)[0])


def _column(peak: tuple[int, int]) -> int:
    """Return the horizontal frequency of a peak, signed so that the vertical one is positive."""
    return peak[1] if peak[0] >= 0 else -peak[1]


def _is_along(spectrum: Spectrum, peak: tuple[int, int]) -> bool:
    """Whether a peak's wave is constant along the scan lines."""
    return abs(peak[1]) <= 1 and abs(refined(spectrum, peak)[1]) <= _OFF_MAX and _is_a_line(spectrum, peak)


def _is_harmonic(frequency: float, gratings: list[float]) -> bool:
    """Whether a frequency is a multiple of a grating's frequency."""
    return any(
        each >= _FEWEST_LINES and abs(frequency - round(frequency / each) * each) <= _HARMONIC_BINS for each in gratings
    )


def _repeats(spectrum: Spectrum, peak: tuple[int, int]) -> bool:
    """Whether the profile across the scan lines repeats after a peak's period, apart from slower waves.

    The transform of the power is the autocorrelation of the windowed profile, with that of the window as a factor."""
    frequency = _frequency(spectrum, peak)
    ky = np.arange(math.ceil(frequency / _BAND), len(spectrum.power) // 2)
    power = np.array([spectrum.at(int(each), _column(peak)) for each in ky])
    turn = 2 * math.pi / frequency
    overlap = 2 / 3 * (1 - 1 / frequency) * (1 + math.cos(turn) / 2) + math.sin(turn) / (2 * math.pi)
    return bool(power.any()) and float(power @ np.cos(turn * ky)) >= _ALIKE * overlap * float(power.sum())


def _is_a_line(spectrum: Spectrum, peak: tuple[int, int]) -> bool:
    """Whether a peak has little power at other horizontal frequencies; False if there are too few of them."""
    if spectrum.power.shape[1] <= _SIDES[1]:
        return False
    across = range(_SIDES[0], _SIDES[1] + 1)
    sides = [spectrum.at(peak[0] + dy, sign * dx) for dy in (-1, 0, 1) for dx in across for sign in (1, -1)]
    return spectrum.at(*peak) > _ABOVE_SIDES * float(np.median(sides))


def _level(spectrum: Spectrum, frequencies: list[float], kx: int) -> float:
    """Estimate the power of line noise near the last of the gratings' frequencies: the lower quartile of the power at
    other vertical frequencies, near it or at the highest, whichever is greater."""
    frequency, highest = frequencies[-1], len(spectrum.power) // 2
    # At the highest frequencies independent shifts are just as strong, and the harmonics of gratings are weak.
    fast = np.arange(highest // 2, highest)
    level = _quartile(spectrum, fast, kx, drift=None) if len(fast) >= _FEWEST else 0.0
    near = _others(frequencies, min(highest, max(_BAND * frequency, frequency + _BAND_BINS)))
    if len(near) >= _FEWEST:
        return max(level, _quartile(spectrum, near, kx, drift=None))
    far = _others(frequencies, min(highest, frequency + _FAR))
    return max(level, _quartile(spectrum, far, kx, drift=frequency)) if len(far) >= _FEWEST else level


def _quartile(spectrum: Spectrum, ky: np.ndarray, kx: int, *, drift: float | None) -> float:
    """Return the lower quartile of the power at vertical frequencies ky (n,). For a `drift`, in which each line's shift
    adds to the last, the power falls with the squared frequency and is scaled to the frequency `drift`."""
    power = np.array([spectrum.at(int(each), kx) for each in ky])
    return float(np.quantile(power if drift is None else power * np.maximum(ky / drift, 1) ** 2, 0.25))


def _others(frequencies: list[float], highest: float) -> np.ndarray:
    """Return vertical frequencies from 1 / _BAND of the last frequency to `highest`, without the lobes of harmonics."""
    last = frequencies[-1]
    ky = np.arange(max(3, int(last / _BAND)), int(highest) + 1)
    free = np.abs(ky - last) > max(_LOBE, _FLANK * last)
    for each in frequencies:
        free &= np.abs(ky - np.maximum(1, np.round(ky / each)) * each) > _LOBE
    return ky[free]


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
# The largest measured distance of a harmonic from a multiple of its wave's or its grating's frequency, in bins.
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
    light        share of visible light in the first order of this sine; 0 if it is not visible
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
    one_way   whether the opposite scan lacks `noise`; else it resembles random shifts"""

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
