# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user wants to know of a scan before baking it: its size, its relief, and the periods that will diffract."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from .height_map import HeightMap
from .levelling import level_plane
from .periods import strongest_periods


@dataclass(frozen=True)
class Description:
    """The facts of a height map; see `describe`.

    rows, cols         the size in pixels
    pixel_size_m       (dy, dx) in metres
    height_range_m     highest minus lowest height in metres, of the measured pixels after plane levelling
    height_rms_m       standard deviation of the same heights in metres
    periods_m          at most five periods in metres, the strongest first; empty where nothing repeats
    period_angles_deg  for each period the direction of its grating vector in degrees: from T, counterclockwise towards
                       B, in (-90, 90]
    channels           labels of all channels of the source
    """

    rows: int
    cols: int
    pixel_size_m: tuple[float, float]
    height_range_m: float
    height_rms_m: float
    periods_m: tuple[float, ...]
    period_angles_deg: tuple[float, ...]
    channels: tuple[str, ...]

    def as_dict(self) -> dict[str, object]:
        """The facts by their names, for JSON: lists in place of tuples."""
        facts = asdict(self)
        return {name: list(value) if isinstance(value, tuple) else value for name, value in facts.items()}


def describe(height_map: HeightMap) -> Description:
    """Measure a height map: its relief after plane levelling, and its strongest periods."""
    level = level_plane(height_map)
    periods, angles = strongest_periods(level)
    return Description(
        rows=height_map.rows,
        cols=height_map.cols,
        pixel_size_m=height_map.pixel_size_m,
        height_range_m=float(np.nanmax(level.height_m) - np.nanmin(level.height_m)),
        height_rms_m=float(np.nanstd(level.height_m)),
        periods_m=tuple(periods),
        period_angles_deg=tuple(angles),
        channels=height_map.channels,
    )
