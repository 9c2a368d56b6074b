# SPDX-License-Identifier: GPL-3.0-or-later
"""What one wants to know of a scan before baking it: size, relief, and the periods that will diffract."""

from __future__ import annotations

import numpy as np

from .height_map import HeightMap
from .levelling import level_plane
from .periods import strongest_periods


def describe(hm: HeightMap) -> dict[str, object]:
    """The figures of a height map, ready for JSON.

    rows, cols, pixel_size_m [dy, dx]
    height_range_m, height_rms_m   highest minus lowest, and standard deviation, both after plane levelling
                                   and over the measured pixels only
    periods_m                      at most five, the strongest first; empty where nothing repeats
    period_angles_deg              direction of each period's grating vector: from T, counterclockwise
                                   towards B, in (-90, 90]
    channels                       names of what else the file holds
    """
    level = level_plane(hm)
    periods, angles = strongest_periods(level)
    return {
        "rows": hm.rows,
        "cols": hm.cols,
        "pixel_size_m": list(hm.pixel_size_m),
        "height_range_m": float(np.nanmax(level.height_m) - np.nanmin(level.height_m)),
        "height_rms_m": float(np.nanstd(level.height_m)),
        "periods_m": periods,
        "period_angles_deg": angles,
        "channels": list(hm.channels),
    }
