# SPDX-License-Identifier: GPL-3.0-or-later
"""Gratings of straight lines along B, with disorder of their distances, depths and directions.

A line's profile is a function of the place across the line, from 0 at its left end to 1 at its right end."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from ..samples.ruled_gratings import blazed_line, ridge, sine_line, wrapping_noise
from .parameters import GratingParameters
from .pixels import Pixels

# Heights, as shares of the depth, at places across a line.
Profile = Callable[[np.ndarray], np.ndarray]

# Random lines do not begin and end between pixels, so each pixel is the mean of this many heights along T.
_PER_PIXEL = 4
_ROWS_AT_ONCE = 128
# The narrowest and the widest line of a random grating, in periods.
_WIDTHS = (0.2, 1.8)
# Lines bend slowly: the correlation lengths of their sideways shift as fractions of the sides (rows, cols). Along T the
# length is great, because a shift that changes along T changes the period too.
_BENDS = (0.05, 0.25)
# The longest wave of a record's signal, in units of the shortest.
_WAVES = 8


def line_heights(parameters: GratingParameters, pixels: Pixels) -> np.ndarray:
    """Make the heights (rows, cols) in metres of a grating of lines; as many rows as columns."""
    if parameters.is_regular:
        return np.tile(_line(parameters, pixels.per_period), (pixels.count, pixels.periods))
    return _random_lines(parameters, pixels, profile_of(parameters))


def _line(parameters: GratingParameters, samples: int) -> np.ndarray:
    """One period of a regular grating: heights (samples,) in metres. The profile begins at the first pixel's middle."""
    if parameters.kind == "sinusoidal":
        return sine_line(parameters.depth_m, samples)
    if parameters.kind == "binary":
        return parameters.depth_m * ridge(parameters.duty, samples)
    if parameters.kind == "blazed":
        return blazed_line(parameters.depth_m, samples)
    return parameters.depth_m * profile_of(parameters)(np.arange(samples) / samples)


def profile_of(parameters: GratingParameters) -> Profile:
    """The profile of a kind of lines."""
    duty = parameters.duty
    profiles: dict[str, Profile] = {
        "sinusoidal": lambda x: np.sin(2 * np.pi * x) / 2,
        "binary": lambda x: np.where(x < duty, 1.0, 0.0),
        "blazed": lambda x: x,
        "echelle": partial(_facets, long=np.cos(np.radians(parameters.angle_deg)) ** 2),
        "groove": partial(_groove, duty=duty, roundness=parameters.roundness),
    }
    return profiles[parameters.kind]


def line_starts(rng: np.random.Generator, count: int, disorder: float) -> np.ndarray:
    """Draw where each line begins and the last one ends (count + 1,), in periods. The mean width of a line is 1.

    `disorder` is the standard deviation of the widths, of which the most extreme are cut."""
    widths = np.clip(1 + disorder * rng.standard_normal(count), *_WIDTHS)
    return np.concatenate([[0.0], np.cumsum(widths)]) * (count / widths.sum())


def depth_shares(rng: np.random.Generator, shape: tuple[int, ...], disorder: float) -> np.ndarray:
    """Draw depths as shares of the mean depth. None is negative."""
    return np.maximum(1 + disorder * rng.standard_normal(shape), 0.0)


def _facets(x: np.ndarray, *, long: float) -> np.ndarray:
    """Rise over the share `long` of the period, then fall."""
    return np.where(x < long, x / long, (1 - x) / (1 - long))


def _groove(x: np.ndarray, *, duty: float, roundness: float) -> np.ndarray:
    """Lie at 0 on the land, and sink to -1 in the middle of the groove."""
    aside = np.minimum(np.abs(2 * x - 1) / duty, 1.0)
    return roundness * (1 - np.cos(np.pi * aside)) / 2 + (1 - roundness) * aside - 1


def _random_lines(parameters: GratingParameters, pixels: Pixels, profile: Profile) -> np.ndarray:
    # A generator of its own for each: no disorder changes the random values of another.
    rngs = [np.random.default_rng([parameters.seed, k]) for k in range(4)]
    starts = line_starts(rngs[0], pixels.periods, parameters.period_disorder)
    shares = depth_shares(rngs[1], (pixels.periods,), parameters.depth_disorder)
    signals = _signals(rngs[3], parameters, pixels)
    if not (parameters.direction_disorder_deg or parameters.modulation_nm):
        row = _rows(starts, shares, pixels, profile, np.zeros((1, 1)), signals[:1])
        return parameters.depth_m * np.repeat(row, pixels.count, axis=0)
    bends = _bends(rngs[2], parameters.direction_disorder_deg, pixels)
    blocks = [slice(k, k + _ROWS_AT_ONCE) for k in range(0, pixels.count, _ROWS_AT_ONCE)]
    return parameters.depth_m * np.concatenate(
        [_rows(starts, shares, pixels, profile, bends[block], signals[block]) for block in blocks]
    )


def _rows(
    starts: np.ndarray, shares: np.ndarray, pixels: Pixels, profile: Profile, bends: np.ndarray, signals: np.ndarray
) -> np.ndarray:
    """Evaluate rows of lines as shares of the depth. `bends` (rows, 1 or cols) shifts the whole surface along T,
    `signals` (rows, lines) shifts the profile in each line; both in periods."""
    within = (np.arange(_PER_PIXEL) + 0.5) / _PER_PIXEL - 0.5
    place = (np.arange(pixels.count)[:, None] + within) / pixels.per_period
    place = (place + bends[:, :, None]) % pixels.periods
    phase = np.interp(place, starts, np.arange(pixels.periods + 1.0))
    line = np.minimum(phase.astype(int), pixels.periods - 1)
    shift = signals[np.arange(len(signals))[:, None, None], line]
    # A groove stays within its line, and there is land at the line's ends.
    heights = shares[line] * profile(np.clip(phase - line - shift, 0.0, 1.0))
    return heights.mean(axis=-1)


def _bends(rng: np.random.Generator, disorder_deg: float, pixels: Pixels) -> np.ndarray:
    """Draw the sideways shift (rows, cols) of bent lines, in periods. The rms of its slope is the disorder's."""
    if not disorder_deg:
        return np.zeros((pixels.count, 1))
    shift = wrapping_noise(rng, (pixels.count, pixels.count), _BENDS)
    slope = (np.roll(shift, -1, axis=0) - shift) * pixels.per_period
    return shift * (np.tan(np.radians(disorder_deg)) / slope.std())


def _signals(rng: np.random.Generator, parameters: GratingParameters, pixels: Pixels) -> np.ndarray:
    """Draw a band-limited signal (rows, lines) for each line, in periods, up to the modulation."""
    if not parameters.modulation_nm:
        return np.zeros((pixels.count, pixels.periods))
    waves = np.arange(pixels.count // 2 + 1)
    highest = max(pixels.length_m / (parameters.wave_um * 1e-6), 1.0)
    band = (waves >= max(highest / _WAVES, 1.0)) & (waves <= highest)
    spectrum = np.zeros((len(waves), pixels.periods), complex)
    spectrum[band] = np.exp(2j * np.pi * rng.random((int(band.sum()), pixels.periods)))
    signals = np.fft.irfft(spectrum, pixels.count, axis=0)
    swing = parameters.modulation_nm * 1e-9 / parameters.period_m
    return signals * (swing / np.abs(signals).max(axis=0))
