# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions of (u, v), the tangential components of wi + wr (docs/theory.md, Conventions)."""

from typing import NamedTuple

import numpy as np

# |(u, v)| is at most 2, where light and viewer both graze the surface on the same side.
FARTHEST = 2.0


class Region(NamedTuple):
    """A rectangle of (u, v): the least and the greatest u, then the least and the greatest v.

    The default holds every pair of directions."""

    u: tuple[float, float] = (-FARTHEST, FARTHEST)
    v: tuple[float, float] = (-FARTHEST, FARTHEST)

    @property
    def reach(self) -> float:
        """The greatest |u| or |v| in the region."""
        return max(abs(end) for end in (*self.u, *self.v))

    @property
    def share_of_disc(self) -> float:
        """The share of all (u, v) that the region holds: of the disc |(u, v)| <= 2."""
        ends = np.linspace(-FARTHEST, FARTHEST, 401)
        middles = (ends[1:] + ends[:-1]) / 2
        u, v = np.meshgrid(middles, middles)
        disc = u**2 + v**2 <= FARTHEST**2
        return float((self.contains(u, v) & disc).sum() / disc.sum())

    @property
    def is_whole(self) -> bool:
        """Whether the region holds every pair of directions, up to rounding."""
        return all(low <= 1e-9 - FARTHEST and high >= FARTHEST - 1e-9 for low, high in self)

    def contains(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Whether each of the points u, v (...,) lies in the region or on its rim; boolean (...,)."""
        return (u >= self.u[0]) & (u <= self.u[1]) & (v >= self.v[0]) & (v <= self.v[1])
