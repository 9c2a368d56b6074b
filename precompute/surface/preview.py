# SPDX-License-Identifier: GPL-3.0-or-later
"""What levelling makes of a scan, before it is baked: pictures and figures before the steps and after them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .height_map import HeightMap
from .least_squares_plane import level_plane
from .periods import Wave, length_in_words, waves_of
from .steps.pipeline import level
from .steps.step import Step

# A larger scan is thinned to this many pixels a side, so that usual steps take less than a second.
SIDE_MAX = 768
# Sides of the pictures in pixels, at most.
_PICTURE_MAX = 256
# Heights beyond these percentiles are as dark, or as bright, as a picture gets: dust leaves the relief its greys.
_DARKEST, _BRIGHTEST = 1.0, 99.0
_MISSING = (0.9, 0.1, 0.1)


@dataclass(frozen=True)
class Look:
    """What heights look like.

    picture  (rows, cols, 3) from 0 to 1, row 0 on top: grey, bright where it is high, red where pixels are missing
    range_m  highest minus lowest height in metres
    rms_m    standard deviation of the heights in metres
    wave     the wave that sends out the most light, of the levelled heights; None where nothing repeats"""

    picture: np.ndarray
    range_m: float
    rms_m: float
    wave: Wave | None

    def in_words(self) -> tuple[str, str, str]:
        """Range, rms and main period."""
        period = "no period" if self.wave is None else self.wave.in_words()
        return f"range {length_in_words(self.range_m)}", f"rms {length_in_words(self.rms_m)}", period


@dataclass(frozen=True)
class Preview:
    """Heights before and after levelling, and what the steps have to tell (see Levelled)."""

    before: Look
    after: Look
    told: tuple[str, ...]


def thinned(height_map: HeightMap) -> HeightMap:
    """Every so manyth row and column of a scan, so that no side has more than SIDE_MAX pixels."""
    every = -(-max(height_map.height_m.shape) // SIDE_MAX)
    if every == 1:
        return height_map
    pixel = tuple(every * side for side in height_map.pixel_size_m)
    wraps = height_map.periodic and not any(n % every for n in height_map.height_m.shape)
    # A copy, so that the scan itself is not kept in memory.
    height = height_map.height_m[::every, ::every].copy()
    return replace(height_map, height_m=height, pixel_size_m=pixel, periodic=wraps)


def preview(height_map: HeightMap, steps: Sequence[Step]) -> Preview:
    """Level a scan and look at it before and after. Raises GratingError as `level` does."""
    levelled = level(height_map, steps)
    return Preview(look(height_map), look(levelled.height_map), levelled.told)


def look(height_map: HeightMap) -> Look:
    """A picture of heights, and their figures."""
    finite = height_map.height_m[np.isfinite(height_map.height_m)]
    gratings = waves_of(level_plane(height_map)).gratings
    wave = gratings[0] if gratings else None
    return Look(_picture(height_map.height_m, finite), float(np.ptp(finite)), float(finite.std()), wave)


def _picture(height: np.ndarray, finite: np.ndarray) -> np.ndarray:
    """The picture (rows, cols, 3) of heights, by the mean of blocks; a block with a missing pixel is red."""
    dark, bright = np.percentile(finite, (_DARKEST, _BRIGHTEST))
    blocks = _blocks(height)
    missing = np.isnan(blocks).any(axis=(1, 3))
    grey = np.nan_to_num((blocks.mean(axis=(1, 3)) - dark) / ((bright - dark) or 1.0))
    return np.where(missing[..., None], _MISSING, np.clip(grey, 0, 1)[..., None])


def _blocks(height: np.ndarray) -> np.ndarray:
    """Heights as blocks (rows, side, cols, side) of a picture's pixels; a rest at the edges is left out."""
    side = max(1, -(-max(height.shape) // _PICTURE_MAX))
    rows, cols = (max(1, n // side) for n in height.shape)
    # A scan of fewer rows than a block is high is a block as high as it.
    high, wide = (min(side, n) for n in height.shape)
    return height[: rows * high, : cols * wide].reshape(rows, high, cols, wide)
