# SPDX-License-Identifier: GPL-3.0-or-later
"""The surfaces of gratings by their parameters. Their grating vectors point along the tangent T."""

from __future__ import annotations

import numpy as np

from ..height_map import HeightMap
from ..samples.discs import Disc, disc_heights
from .brushed import brushed_heights
from .lattices import crossed_heights, hexagonal_heights
from .lines import line_heights
from .parameters import GratingParameters, parse_grating
from .pixels import Pixels, pixels_of

# The shortest and the longest pit or land of a CD, in channel bits.
_RUNS = (3, 11)
# The slope of a pit's side, as a share of the pit's width. A CD's is 80 nm of 500 nm.
_SLOPE = 0.16


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
        heights = brushed_heights(parameters, pixels)
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
