# SPDX-License-Identifier: GPL-3.0-or-later
"""Line noise of a microscope: heights that jump from one line of the scan to the next, and their chance peaks.

Between two lines a microscope's heights shift by a random amount. Such shifts are constant along each row, so that
their power lies at one frequency along the rows, 0, and at all frequencies across them. The highest of its many chance
peaks stands far over the rest of the spectrum, as a grating with lines along the rows does. But a grating also stands
over its neighbours at that one frequency, or, if it is a natural one that is not quite regular, has power beside it.
"""

from __future__ import annotations

import math

import numpy as np

from .height_spectrum import Spectrum, refined

# Noise is exponentially distributed. The strongest of 500 rows' frequencies has ln(500) = 6.2 times the mean power, or
# 22 times the lower quartile. The rows of the real skins, turned along the scan's rows, have 100 times it and more.
_ABOVE_QUARTILE = 50.0
# So much stronger than the waves beside it is what is constant along the rows. Of irregular ridges there is more.
_ABOVE_SIDES = 50.0
# Bins beside a peak that are past the window's lobe, and yet near.
_SIDES = (3, 8)
# How far off the frequency 0 along the rows noise may seem to be, in bins.
_OFF_MAX = 0.6
# The frequencies along the column that a peak is compared with: from 1 / 1.5 to 1.5 times its own, at least so many
# bins on, but without its own flanks and the lobes of harmonics.
_BAND, _BAND_BINS, _FLANK, _LOBE = 1.5, 12, 0.2, 2.0
# How alike a grating's profile and its copy one period on are at least, from 0 to 1. Those of white noise are alike by
# 0 on the average, with a standard deviation of 0.13 for 128 rows.
_ALIKE = 0.7
# A grating of fewer lines has harmonics so close together that any peak would be one.
_FEWEST_LINES = 6
# How far a harmonic may be off a multiple of its grating's frequency, in bins.
_HARMONIC_BINS = 1.0
# Of fewer bins the quartile says nothing; then this many bins on are taken.
_FEWEST, _FAR = 8, 64


def line_noise(
    spectrum: Spectrum, peaks: list[tuple[int, int]], waviness: list[tuple[int, int]]
) -> list[tuple[int, int]]:
    """Those of a scan's peaks (ky, kx), the strongest first, that cannot be told from chance peaks of line noise.

    `waviness` is the peak of a slower wave, if there is one: the peaks may be its harmonics."""
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
    """The row frequency of a peak, in cycles per scan."""
    return abs(refined(spectrum, peak)[0])


def _column(peak: tuple[int, int]) -> int:
    """The frequency along the rows of a peak whose row frequency is taken as positive."""
    return peak[1] if peak[0] >= 0 else -peak[1]


def _is_along(spectrum: Spectrum, peak: tuple[int, int]) -> bool:
    """Whether a peak's wave runs along the rows, and is constant along each."""
    return abs(peak[1]) <= 1 and abs(refined(spectrum, peak)[1]) <= _OFF_MAX and _is_alone(spectrum, peak)


def _is_harmonic(frequency: float, gratings: list[float]) -> bool:
    """Whether a frequency is a multiple of a grating's."""
    return any(
        each >= _FEWEST_LINES and abs(frequency - round(frequency / each) * each) <= _HARMONIC_BINS for each in gratings
    )


def _repeats(spectrum: Spectrum, peak: tuple[int, int]) -> bool:
    """Whether the profile across the rows repeats itself after the period of a peak, slower waves left out.

    The power's transform is the autocorrelation of the profile under the spectrum's window, of which that of the window
    is a factor."""
    frequency = _frequency(spectrum, peak)
    ky = np.arange(math.ceil(frequency / _BAND), len(spectrum.power) // 2)
    power = np.array([spectrum.at(int(each), _column(peak)) for each in ky])
    turn = 2 * math.pi / frequency
    overlap = 2 / 3 * (1 - 1 / frequency) * (1 + math.cos(turn) / 2) + math.sin(turn) / (2 * math.pi)
    return bool(power.any()) and float(power @ np.cos(turn * ky)) >= _ALIKE * overlap * float(power.sum())


def _is_alone(spectrum: Spectrum, peak: tuple[int, int]) -> bool:
    """Whether a peak has little beside it at other frequencies along the rows; False where there are too few."""
    if spectrum.power.shape[1] <= _SIDES[1]:
        return False
    across = range(_SIDES[0], _SIDES[1] + 1)
    sides = [spectrum.at(peak[0] + dy, sign * dx) for dy in (-1, 0, 1) for dx in across for sign in (1, -1)]
    return spectrum.at(*peak) > _ABOVE_SIDES * float(np.median(sides))


def _level(spectrum: Spectrum, frequencies: list[float], kx: int) -> float:
    """The level of line noise about the last of the frequencies of gratings along a column of the spectrum, in cycles
    per scan: the lower quartile of the power at others there, or, if it is more, at the highest."""
    frequency, highest = frequencies[-1], len(spectrum.power) // 2
    # Shifts that are independent of each other are as strong there, and the harmonics of gratings are weak.
    fast = np.arange(highest // 2, highest)
    level = _quartile(spectrum, fast, kx, drift=None) if len(fast) >= _FEWEST else 0.0
    near = _others(frequencies, min(highest, max(_BAND * frequency, frequency + _BAND_BINS)))
    if len(near) >= _FEWEST:
        return max(level, _quartile(spectrum, near, kx, drift=None))
    far = _others(frequencies, min(highest, frequency + _FAR))
    return max(level, _quartile(spectrum, far, kx, drift=frequency)) if len(far) >= _FEWEST else level


def _quartile(spectrum: Spectrum, ky: np.ndarray, kx: int, *, drift: float | None) -> float:
    """The lower quartile of the power at row frequencies ky (n,); of a `drift`, in which each line's shift adds to the
    last one's, as it would be at this frequency: its power falls with the square of the frequency."""
    power = np.array([spectrum.at(int(each), kx) for each in ky])
    return float(np.quantile(power if drift is None else power * np.maximum(ky / drift, 1) ** 2, 0.25))


def _others(frequencies: list[float], highest: float) -> np.ndarray:
    """The row frequencies from 1 / _BAND of the last frequency to the highest, without the lobes of all frequencies'
    harmonics."""
    last = frequencies[-1]
    ky = np.arange(max(3, int(last / _BAND)), int(highest) + 1)
    free = np.abs(ky - last) > max(_LOBE, _FLANK * last)
    for each in frequencies:
        free &= np.abs(ky - np.maximum(1, np.round(ky / each)) * each) > _LOBE
    return ky[free]
