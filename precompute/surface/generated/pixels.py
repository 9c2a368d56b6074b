# SPDX-License-Identifier: GPL-3.0-or-later
"""The pixels of a grating: how many to a period, and how many periods."""

from __future__ import annotations

import math
from dataclasses import dataclass

# The side that a map aims at, that of the samples.
_SIDE_M = 65e-6
# Pixels are at most this large: a bake needs a quarter of the shortest wavelength, 95 nm.
_PIXEL_M = 80e-9
_PER_PERIOD_MIN = 16
# The fewest periods: the search for periods needs three, and an average over random lines needs several.
_PERIODS_MIN = 8
# A map gets no more periods beyond this many pixels a side. Only coarse periods, with _PERIODS_MIN periods, have more.
_PIXELS = 1536


@dataclass(frozen=True)
class Pixels:
    """The pixels along one axis: `periods` periods of `per_period` pixels of `pixel_m` metres."""

    periods: int
    per_period: int
    pixel_m: float

    @property
    def count(self) -> int:
        """The number of pixels."""
        return self.periods * self.per_period

    @property
    def length_m(self) -> float:
        """The side in metres."""
        return self.count * self.pixel_m


def pixels_of(period_m: float) -> Pixels:
    """Choose an even number of pixels to a period, and an even number of periods."""
    per_period = max(_PER_PERIOD_MIN, 2 * math.ceil(period_m / (2 * _PIXEL_M) - 1e-9))
    most = max(_PERIODS_MIN, _PIXELS // per_period)
    periods = min(max(2 * round(_SIDE_M / (2 * period_m)), _PERIODS_MIN), most)
    return Pixels(periods - periods % 2, per_period, period_m / per_period)
