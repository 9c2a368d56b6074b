# SPDX-License-Identifier: GPL-3.0-or-later
"""Gratings in two directions: square posts in a square lattice, and round bumps in a hexagonal one."""

from __future__ import annotations

import math

import numpy as np

from ..samples.ruled_gratings import ridge
from .lines import depth_shares, line_starts
from .parameters import GratingParameters
from .pixels import Pixels

# A bump is shifted by at most half a period.
_SHIFT_MAX = 0.5


def crossed_heights(parameters: GratingParameters, pixels: Pixels) -> np.ndarray:
    """Make the heights (rows, cols) in metres of square posts on a floor of 0."""
    if parameters.is_regular:
        row = np.tile(ridge(parameters.duty, pixels.per_period), pixels.periods)
        return parameters.depth_m * row[:, None] * row
    rngs = [np.random.default_rng([parameters.seed, k]) for k in range(3)]
    (y, below), (x, beside) = (
        _posts(line_starts(rng, pixels.periods, parameters.period_disorder), parameters.duty, pixels)
        for rng in rngs[:2]
    )
    shares = depth_shares(rngs[2], (pixels.periods, pixels.periods), parameters.depth_disorder)
    return parameters.depth_m * y[:, None] * x * shares[below[:, None], beside]


def _posts(starts: np.ndarray, duty: float, pixels: Pixels) -> tuple[np.ndarray, np.ndarray]:
    """The share of each pixel (count,) along an axis that a post covers, and the post's number."""
    edges = np.arange(pixels.count + 1) / pixels.per_period
    widths = np.diff(starts)
    # The length covered by posts from 0 to each edge.
    line = np.clip(np.searchsorted(starts, edges, side="right") - 1, 0, pixels.periods - 1)
    covered = duty * (starts[line] + np.minimum((edges - starts[line]) / duty, widths[line]))
    # A pixel at a line's end belongs to the line of its left edge, whose post ends before.
    number = line[:-1] + (np.diff(line) > 0)
    return np.diff(covered) * pixels.per_period, np.minimum(number, pixels.periods - 1)


def hexagonal_heights(parameters: GratingParameters, pixels: Pixels) -> tuple[np.ndarray, float]:
    """Make the heights (rows, cols) in metres of touching round bumps, and the height of a pixel in metres.

    The rows of bumps run along B, a period apart. Neighbours in a row are 2 / sqrt(3) periods apart."""
    apart = 2 / math.sqrt(3)
    per_bump = 2 * math.ceil(pixels.per_period * apart / 2 - 1e-9)
    bumps = max(1, round(pixels.periods / apart))
    pixel_m = apart * parameters.period_m / per_bump
    if parameters.is_regular:
        cell = _bumps(np.zeros((2, 1, 2)), np.ones((2, 1)), (pixels.per_period, per_bump))
        return parameters.depth_m * np.tile(cell, (bumps, pixels.periods // 2)), pixel_m
    rngs = [np.random.default_rng([parameters.seed, k]) for k in range(2)]
    shifts = parameters.period_disorder * rngs[0].standard_normal((pixels.periods, bumps, 2))
    shares = depth_shares(rngs[1], (pixels.periods, bumps), parameters.depth_disorder)
    shifts = np.clip(shifts, -_SHIFT_MAX, _SHIFT_MAX)
    return parameters.depth_m * _bumps(shifts, shares, (pixels.per_period, per_bump)), pixel_m


def _bumps(shifts: np.ndarray, shares: np.ndarray, per_bump: tuple[int, int]) -> np.ndarray:
    """Evaluate bumps as shares of the depth, with their shifts (across, along, 2) in periods along T and B.

    `per_bump` is the number of pixels to a bump along T and along B."""
    across, along = shares.shape
    apart = 2 / math.sqrt(3)
    x = np.arange(across * per_bump[0]) / per_bump[0]
    y = np.arange(along * per_bump[1])[:, None] / per_bump[1]
    column = np.rint(x).astype(int)
    highest = np.zeros((y.size, x.size))
    for i in (column - 1, column, column + 1):
        offset = (i % 2) / 2
        nearest = np.rint(y - offset).astype(int)
        for j in (nearest - 1, nearest, nearest + 1):
            which = (i % across, j % along)
            shift = shifts[which]
            squared = (x - i - shift[..., 0]) ** 2 + (apart * (y - j - offset) - shift[..., 1]) ** 2
            aside = np.minimum(np.sqrt(squared) / (apart / 2), 1.0)
            np.maximum(highest, shares[which] * np.cos(np.pi / 2 * aside) ** 2, out=highest)
    return highest
