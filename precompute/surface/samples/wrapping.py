# SPDX-License-Identifier: GPL-3.0-or-later
"""The height map of a synthetic surface whose edges wrap."""

from __future__ import annotations

import numpy as np

from ..height_map import HeightMap


def wrapping_surface(name: str, height_m: np.ndarray, pixel_m: float) -> HeightMap:
    return HeightMap(height_m, (pixel_m, pixel_m), f"sample:{name}", periodic=True)
