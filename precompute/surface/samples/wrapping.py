# SPDX-License-Identifier: GPL-3.0-or-later
"""Height maps of synthetic surfaces whose edges wrap, and random fields that wrap."""

from __future__ import annotations

import numpy as np

from ..height_map import SAMPLE_PREFIX, HeightMap


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
