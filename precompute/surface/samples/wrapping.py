# SPDX-License-Identifier: GPL-3.0-or-later
"""Height maps of synthetic surfaces whose edges wrap."""

from __future__ import annotations

import numpy as np

from ..height_map import SAMPLE_PREFIX, HeightMap


def wrapping_surface(name: str, height_m: np.ndarray, pixel_m: float) -> HeightMap:
    """Make the periodic height map sample:NAME of heights (rows, cols) and square pixels, both in metres."""
    return HeightMap(height_m, (pixel_m, pixel_m), f"{SAMPLE_PREFIX}{name}", periodic=True)
