# SPDX-License-Identifier: GPL-3.0-or-later
"""Regions of (u, v), the tangential components of wi + wr (docs/theory.md, Conventions)."""

from typing import NamedTuple

import numpy as np

# |(u, v)| reaches 2 if light and viewer both graze the surface on the same side.
FARTHEST = 2.0
# w = cos(ti) + cos(tr) reaches 2 if both look along the normal.
W_MAX = 2.0
# An end of a region this close to FARTHEST is at FARTHEST.
_ROUNDING = 1e-9


class Region(NamedTuple):
    """A rectangle of (u, v): least and greatest u, then least and greatest v.

    The default contains every pair of directions."""

    u: tuple[float, float] = (-FARTHEST, FARTHEST)
    v: tuple[float, float] = (-FARTHEST, FARTHEST)

    @property
    def reach(self) -> float:
        """The greatest |u| or |v| in the region."""
        return max(abs(end) for end in (*self.u, *self.v))

    @property
    def share_of_disc(self) -> float:
        """The share of the disc |(u, v)| <= 2, which is all (u, v), that the region contains."""
        ends = np.linspace(-FARTHEST, FARTHEST, 401)
        middles = (ends[1:] + ends[:-1]) / 2
        u, v = np.meshgrid(middles, middles)
        disc = u**2 + v**2 <= FARTHEST**2
        return float((self.contains(u, v) & disc).sum() / disc.sum())

    def contains(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Whether each of the points u, v (...,) lies in the region or on its rim."""
        return (u >= self.u[0]) & (u <= self.u[1]) & (v >= self.v[0]) & (v <= self.v[1])

    def known(self, margin: float) -> "Region":
        """The part with a distance of `margin` from the sides at which the region ends short of FARTHEST. The light
        beyond these sides is unknown."""
        sides = (
            (low + margin * (low > _ROUNDING - FARTHEST), high - margin * (high < FARTHEST - _ROUNDING))
            for low, high in self
        )
        return Region(*sides)
