# SPDX-License-Identifier: GPL-3.0-or-later
"""Preview of levelling: pictures and figures of a scan before and after the steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .height_map import HeightMap, level_plane
from .periods import Wave, length_in_words, waves_of
from .steps.pipeline import level
from .steps.step import Step

# Larger scans are thinned to this many pixels a side, so that usual steps take less than a second.
SIDE_MAX = 768
# The longest side of a picture in pixels.
_PICTURE_MAX = 256
# The percentiles of black and white. Without them dust would leave the relief few greys.
_DARKEST, _BRIGHTEST = 1.0, 99.0
_MISSING = (0.9, 0.1, 0.1)


@dataclass(frozen=True)
class Look:
    """Picture and figures of heights.

    picture  (rows, cols, 3) in [0, 1], row 0 on top: high is bright, missing pixels are red
    range_m  highest minus lowest height in metres
    rms_m    standard deviation of the heights in metres
    wave     the brightest grating of the levelled heights, or None"""

    picture: np.ndarray
    range_m: float
    rms_m: float
    wave: Wave | None

    def in_words(self) -> tuple[str, str, str]:
        """Format range, rms and main period."""
        period = "no period" if self.wave is None else self.wave.in_words()
        return f"range {length_in_words(self.range_m)}", f"rms {length_in_words(self.rms_m)}", period


@dataclass(frozen=True)
class Preview:
    """Heights before and after levelling, and the steps' messages (see Levelled)."""

    before: Look
    after: Look
    told: tuple[str, ...]


def thinned(height_map: HeightMap) -> HeightMap:
    """Keep every n-th row and column of a scan, so that no side exceeds SIDE_MAX pixels."""
    every = -(-max(height_map.height_m.shape) // SIDE_MAX)
    if every == 1:
        return height_map
    pixel = tuple(every * side for side in height_map.pixel_size_m)
    wraps = height_map.periodic and not any(n % every for n in height_map.height_m.shape)
    # A copy, since a view would keep the scan in memory.
    height = height_map.height_m[::every, ::every].copy()
    return replace(height_map, height_m=height, pixel_size_m=pixel, periodic=wraps)


def preview(height_map: HeightMap, steps: Sequence[Step]) -> Preview:
    """Level a scan and show it before and after. Raises GratingError as `level` does."""
    levelled = level(height_map, steps)
    return Preview(look(height_map), look(levelled.height_map), levelled.told)


def look(height_map: HeightMap) -> Look:
    """Make the picture and figures of heights."""
    finite = height_map.height_m[np.isfinite(height_map.height_m)]
    gratings = waves_of(level_plane(height_map)).gratings
    wave = gratings[0] if gratings else None
    return Look(_picture(height_map.height_m, finite), float(np.ptp(finite)), float(finite.std()), wave)


def _picture(height: np.ndarray, finite: np.ndarray) -> np.ndarray:
    """Average heights to a picture (rows, cols, 3); blocks with a missing pixel are red."""
    dark, bright = np.percentile(finite, (_DARKEST, _BRIGHTEST))
    blocks = _blocks(height)
    missing = np.isnan(blocks).any(axis=(1, 3))
    grey = np.nan_to_num((blocks.mean(axis=(1, 3)) - dark) / ((bright - dark) or 1.0))
    return np.where(missing[..., None], _MISSING, np.clip(grey, 0, 1)[..., None])


def _blocks(height: np.ndarray) -> np.ndarray:
    """Split heights into the blocks (rows, side, cols, side) of a picture's pixels, without a rest at the edges."""
    side = max(1, -(-max(height.shape) // _PICTURE_MAX))
    rows, cols = (max(1, n // side) for n in height.shape)
    # A scan narrower than a block is one block wide.
    high, wide = (min(side, n) for n in height.shape)
    return height[: rows * high, : cols * wide].reshape(rows, high, cols, wide)
