# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions of (u, v), the tangential components of the sum of the directions to the light and to the viewer."""

from typing import NamedTuple

import numpy as np

# |(u, v)| is at most 2, where light and view both graze the surface from one side.
FARTHEST = 2.0


class Region(NamedTuple):
    """A rectangle of (u, v): the lowest and the highest u, the lowest and the highest v. By default all that two
    directions reach."""

    u: tuple[float, float] = (-FARTHEST, FARTHEST)
    v: tuple[float, float] = (-FARTHEST, FARTHEST)

    @property
    def reach(self) -> float:
        """The largest |u| or |v| in it."""
        return max(abs(end) for end in (*self.u, *self.v))

    @property
    def is_whole(self) -> bool:
        """Whether it holds every direction, up to rounding."""
        return all(low <= 1e-9 - FARTHEST and high >= FARTHEST - 1e-9 for low, high in self)

    def contains(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Which of the places u, v (...,) lie in it, its rim included; boolean (...,)."""
        return (u >= self.u[0]) & (u <= self.u[1]) & (v >= self.v[0]) & (v <= self.v[1])
