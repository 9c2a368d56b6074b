# SPDX-License-Identifier: GPL-3.0-or-later
"""Brushed metal: a random relief whose waves have about the asked period and about the direction T."""

from __future__ import annotations

import numpy as np

from .parameters import GratingParameters
from .pixels import Pixels

# The least width of the lobe in bins of the spectrum. Below it a wave would have no bin.
_BINS_MIN = 0.5


def brushed_heights(parameters: GratingParameters, pixels: Pixels) -> np.ndarray:
    """Make the heights (rows, cols) in metres of Gaussian noise with the rms of a sine of the depth.

    The spectrum is a lobe. The standard deviations of its frequency and its direction are the disorders."""
    n, periods = pixels.count, pixels.periods
    frequency_y, frequency_x = np.fft.fftfreq(n, 1 / n)[:, None], np.arange(n // 2 + 1)
    frequency = np.hypot(frequency_y, frequency_x)
    angle = np.arctan2(frequency_y, frequency_x)
    spread = max(parameters.period_disorder * periods, _BINS_MIN)
    turn = max(np.radians(parameters.direction_disorder_deg), _BINS_MIN / periods)
    lobe = np.exp(-(((frequency - periods) / spread) ** 2 + (angle / turn) ** 2) / 4)
    lobe[0, 0] = 0.0
    noise = np.fft.rfft2(np.random.default_rng(parameters.seed).standard_normal((n, n)))
    heights = np.fft.irfft2(lobe * noise, s=(n, n))
    return heights * (parameters.depth_m / (2 * np.sqrt(2)) / heights.std())
