# SPDX-License-Identifier: GPL-3.0-or-later
"""The surfaces of gratings by their parameters. Their grating vectors point along the tangent T."""

from __future__ import annotations

import numpy as np

from ..height_map import HeightMap
from ..samples.discs import Disc, disc_heights
from .lattices import crossed_heights, hexagonal_heights
from .lines import line_heights
from .parameters import GratingParameters, parse_grating
from .pixels import Pixels, pixels_of

# The shortest and the longest pit or land of a CD, in channel bits.
_RUNS = (3, 11)
# The slope of a pit's side, as a share of the pit's width. A CD's is 80 nm of 500 nm.
_SLOPE = 0.16
# The least width of the lobe of brushed metal in bins of the spectrum. Below it a wave would have no bin.
_BINS_MIN = 0.5


def make_grating(text: str) -> HeightMap:
    """Make the surface of "grating:KIND?NAME=VALUE&...". Its source is the canonical text.

    Raises GratingError as parse_grating does."""
    return surface_of(parse_grating(text))


def surface_of(parameters: GratingParameters) -> HeightMap:
    """Make the surface of a grating: whole periods along both axes, and edges that wrap."""
    pixels = pixels_of(parameters.period_m)
    dy = pixels.pixel_m
    if parameters.kind == "hexagonal":
        heights, dy = hexagonal_heights(parameters, pixels)
    elif parameters.kind == "crossed":
        heights = crossed_heights(parameters, pixels)
    elif parameters.kind == "brushed":
        heights = _brushed(parameters, pixels)
    elif parameters.kind == "pits":
        heights = _pits(parameters, pixels)
    else:
        heights = line_heights(parameters, pixels)
    return HeightMap(heights, (dy, pixels.pixel_m), parameters.text, periodic=True)


def _pits(parameters: GratingParameters, pixels: Pixels) -> np.ndarray:
    """Make the heights (rows, cols) in metres of a disc."""
    width_m, bit_m = parameters.duty * parameters.period_m, parameters.bit_nm / 1e9
    disc = Disc(
        seed=parameters.seed,
        pitch_m=parameters.period_m,
        tracks=pixels.periods,
        samples_per_pitch=pixels.per_period,
        width_m=width_m,
        depth_m=parameters.depth_m,
        channel_bit_m=bit_m,
        runs=_RUNS,
        # A slope fits between pits, along the track and across it.
        edge_m=min(_SLOPE * width_m, bit_m, parameters.period_m - width_m),
    )
    return disc_heights(disc)


def _brushed(parameters: GratingParameters, pixels: Pixels) -> np.ndarray:
    """Make the heights (rows, cols) in metres of brushed metal: Gaussian noise with the rms of a sine of the depth.

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
