# SPDX-License-Identifier: GPL-3.0-or-later
"""The height map of a synthetic surface whose edges wrap."""

from __future__ import annotations

import numpy as np

from ..height_map import SAMPLE_PREFIX, HeightMap


def wrapping_surface(name: str, height_m: np.ndarray, pixel_m: float) -> HeightMap:
    """The periodic height map sample:NAME of heights (rows, cols) in metres, with square pixels of pixel_m metres."""
    return HeightMap(height_m, (pixel_m, pixel_m), f"{SAMPLE_PREFIX}{name}", periodic=True)
