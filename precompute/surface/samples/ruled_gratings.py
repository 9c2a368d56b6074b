# SPDX-License-Identifier: GPL-3.0-or-later
"""Line gratings with exact profiles and grating vectors along the tangent T, the flat mirror, and what all samples
share: height maps and random fields whose edges wrap."""

from __future__ import annotations

import numpy as np

from ..height_map import SAMPLE_PREFIX, HeightMap

_SAMPLES_PER_PERIOD = 32
_PERIODS = 26
_PERIOD_M = 2.5e-6


def flat() -> HeightMap:
    """Mirror: 256 x 256 zeros over 65 um."""
    return wrapping_surface("flat", np.zeros((256, 256)), 65e-6 / 256)


def sinusoidal(
    period_m: float = _PERIOD_M,
    depth_m: float = 200e-9,
    *,
    periods: int = _PERIODS,
    samples_per_period: int = _SAMPLES_PER_PERIOD,
    rows: int = _PERIODS * _SAMPLES_PER_PERIOD,
) -> HeightMap:
    """Sinusoid h = depth / 2 sin(2 pi x / period); the depth is from trough to crest."""
    return _grating("sinusoidal", sine_line(depth_m, samples_per_period), period_m, periods=periods, rows=rows)


def binary(
    period_m: float = _PERIOD_M,
    depth_m: float = 140e-9,
    *,
    duty: float = 0.5,
    periods: int = _PERIODS,
    samples_per_period: int = _SAMPLES_PER_PERIOD,
    rows: int = _PERIODS * _SAMPLES_PER_PERIOD,
) -> HeightMap:
    """Ridges of height `depth_m` on a floor of 0; `duty` is the ridges' share of a period.

    If a ridge ends within a sample, the sample has the mean height."""
    line = depth_m * ridge(duty, samples_per_period)
    return _grating("binary", line, period_m, periods=periods, rows=rows)


def blazed(
    period_m: float = _PERIOD_M,
    depth_m: float = 246.23e-9,
    *,
    periods: int = _PERIODS,
    samples_per_period: int = _SAMPLES_PER_PERIOD,
    rows: int = _PERIODS * _SAMPLES_PER_PERIOD,
) -> HeightMap:
    """Facets that rise along +T with the slope depth / period; the drop lies between two samples.

    A facet's heights are j depth / samples_per_period, j < samples_per_period: the range is a step less than depth."""
    return _grating("blazed", blazed_line(depth_m, samples_per_period), period_m, periods=periods, rows=rows)


def sine_line(depth_m: float, samples: int) -> np.ndarray:
    """One period of `sinusoidal`: heights (samples,) in metres."""
    return depth_m / 2 * np.sin(2 * np.pi * (np.arange(samples) / samples))


def ridge(duty: float, samples: int) -> np.ndarray:
    """The share of each sample (samples,) of a period that a ridge covers. The ridge begins with the first sample."""
    return np.clip(duty * samples - np.arange(samples), 0.0, 1.0)


def blazed_line(depth_m: float, samples: int) -> np.ndarray:
    """One period of `blazed`: heights (samples,) in metres."""
    return depth_m * np.arange(samples) / samples


def _grating(name: str, profile_m: np.ndarray, period_m: float, *, periods: int, rows: int) -> HeightMap:
    """Repeat one period's profile (samples,) along T `periods` times, the same in every row."""
    height = np.broadcast_to(np.tile(profile_m, periods), (rows, periods * len(profile_m)))
    return wrapping_surface(name, height.copy(), period_m / len(profile_m))


def wrapping_surface(name: str, height_m: np.ndarray, pixel_m: float) -> HeightMap:
    """Make the periodic height map sample:NAME of heights (rows, cols) and square pixels, both in metres."""
    return HeightMap(height_m, (pixel_m, pixel_m), f"{SAMPLE_PREFIX}{name}", periodic=True)


def wrapping_noise(rng: np.random.Generator, shape: tuple[int, int], correlation: tuple[float, float]) -> np.ndarray:
    """Draw periodic noise of mean 0 and rms 1, blurred by the given fractions of the sides (rows, cols)."""
    sigma = correlation[0] * shape[0], correlation[1] * shape[1]
    noise = wrapping_blur(rng.standard_normal(shape), sigma)
    noise -= noise.mean()
    return noise / noise.std()


def wrapping_blur(values: np.ndarray, sigma: float | tuple[float, float]) -> np.ndarray:
    """Blur periodically by a Gaussian of standard deviation sigma pixels along (rows, cols)."""
    sigma_y, sigma_x = np.broadcast_to(sigma, 2)
    y = np.exp(-2 * (np.pi * sigma_y * np.fft.fftfreq(values.shape[0])) ** 2)
    x = np.exp(-2 * (np.pi * sigma_x * np.fft.rfftfreq(values.shape[1])) ** 2)
    return np.fft.irfft2(np.fft.rfft2(values) * y[:, None] * x, s=values.shape)
