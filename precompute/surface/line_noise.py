# SPDX-License-Identifier: GPL-3.0-or-later
"""Line noise of a microscope: random height shifts between scan lines, and the false peaks that they cause.

A shift is constant along its scan line. So the noise has power at the horizontal frequency 0 and at all vertical
frequencies. The highest of its many random peaks rises far above the rest of the spectrum, like a grating with lines
along the scan lines. But a grating also rises above its neighbours at the horizontal frequency 0. An irregular, natural
grating has power beside its peak instead."""

from __future__ import annotations

import math

import numpy as np

from .height_spectrum import Spectrum, refined

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
# The largest distance of a harmonic from a multiple of its grating's frequency, in bins.
_HARMONIC_BINS = 1.0
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
    return abs(peak[1]) <= 1 and abs(refined(spectrum, peak)[1]) <= _OFF_MAX and _is_alone(spectrum, peak)


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


def _is_alone(spectrum: Spectrum, peak: tuple[int, int]) -> bool:
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
