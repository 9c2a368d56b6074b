# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bake holds of a surface, and how a renderer reads it.

XYZ(u, v, w) = Z(w) * kernel(u, v) + w^2 * sum_k T_k(t) B_k(u, v),   t from -1 to 1 over the range of w
"""

from dataclasses import dataclass, field

import numpy as np

from ..maths import bspline, chebyshev
from ..optics.region import Region
from .albedo_bound import NO_EXCESS, albedo_bound
from .tiling import TILE_PADDING

# The curve of the zero order lies in one row of the atlas, in the middle of so many alike.
ZERO_ORDER_SAMPLES = 512


# Places of the table that are read at once: what a core's cache holds of their indices and weights.
_READ_AT_ONCE = 4096


@dataclass(frozen=True)
class Table:
    """A relief's table: `terms` (K, rows, columns, 3) float32 holds B_k in XYZ, row along +v, column along +u; the
    middle of texel (row, column) is at `first` (v, u) + (row, column) * texel, by default about (0, 0); T_k is over
    `w_range`. The outermost TILE_PADDING texels on each side are only for reading. `zero_order` (n, 3) is Z at n equal
    steps of w from 0 to 2, ends included. `excess_albedo` (rows, columns) float32 is the excess albedo that albedo.py
    tells of; without one, Stam's form is kept. `precision` is the float that holds the terms well enough in a file.
    `wider` are the same terms under kernels of 2, 4, ... sigma_b, at texels 2, 4, ... times as large (tiling.py)."""

    terms: np.ndarray
    zero_order: np.ndarray
    sigma_b: float
    texel: float
    illuminant: str
    excess_albedo: np.ndarray = field(default_factory=NO_EXCESS.copy)
    first: tuple[float, float] | None = None
    w_range: tuple[float, float] = (0.0, 2.0)
    precision: type = np.float16
    wider: tuple[np.ndarray, ...] = ()

    def __post_init__(self):
        if self.first is None:
            object.__setattr__(self, "first", tuple((1 - n) / 2 * self.texel for n in self.terms.shape[1:3]))

    @property
    def tile(self) -> tuple[int, int]:
        """Rows and columns of a term's tile."""
        return self.terms.shape[1:3]

    @property
    def levels(self) -> tuple[np.ndarray, ...]:
        """The terms of every level, level l under the kernel sigma_b 2^l."""
        return self.terms, *self.wider

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """v (rows,) and u (columns,) of the texels' middles."""
        return tuple(first + np.arange(n) * self.texel for first, n in zip(self.first, self.tile, strict=True))

    @property
    def region(self) -> Region:
        """What the table holds of (u, v); what lies outside is read at its rim."""
        return held_region(self.axes)

    def scattered_over_w2(self, u: np.ndarray, v: np.ndarray, w, variance=0.0) -> np.ndarray:
        """Scattered XYZ over w^2 (n, 3) at u, v (n,), read as a renderer reads it: by cubic B-splines, half floats as
        stored. `variance` (n,) in (u, v) is added to the kernel's by mixing the two levels around it, as far as there
        are any."""
        w, variance = (np.broadcast_to(np.asarray(each, float), np.shape(u)) for each in (w, variance))
        level, share = level_mix(variance / self.sigma_b**2, len(self.levels))
        out = np.zeros((3, len(u)))
        for which in range(len(self.levels)):
            part = np.where(level == which, 1 - share, np.where(level == which - 1, share, 0.0))
            lit = np.flatnonzero(part)
            for start in range(0, len(lit), _READ_AT_ONCE):
                at = lit[start : start + _READ_AT_ONCE]
                out[:, at] += part[at] * self._read(which, u[at], v[at], w[at])
        return out.T

    def _read(self, level: int, u: np.ndarray, v: np.ndarray, w: np.ndarray) -> np.ndarray:
        """XYZ (3, n) of a level. Each channel of a term is one sum over taps, in the table's own precision."""
        terms = self.levels[level]
        _, rows, columns, _ = terms.shape
        (u_low, u_high), (v_low, v_high) = self.region
        texel = self.texel * 2**level
        x, y = (np.clip(u, u_low, u_high) - u_low) / texel, (np.clip(v, v_low, v_high) - v_low) / texel
        places, weights = bspline.patches(y + TILE_PADDING, x + TILE_PADDING, (rows, columns), precision=terms.dtype)
        # Of the X of every texel that counts, in a term laid out flat; Y and Z follow it.
        places *= 3
        low, high = self.w_range
        t = np.clip((2 * w - low - high) / (high - low), -1, 1).astype(terms.dtype)
        out = np.zeros((3, len(u)), terms.dtype)
        for term, polynomial in zip(terms.reshape(len(terms), -1), chebyshev.recurrence(t), strict=False):
            for c in range(3):
                # All places are within the term, and wrapping is what NumPy checks fastest.
                out[c] += polynomial * np.einsum("mn,mn->n", weights, term[c:].take(places, mode="wrap"))
        return out

    def zero_order_xyz(self, w) -> np.ndarray:
        """Z (..., 3) at w (...,), read as a renderer reads it: by a cubic B-spline."""
        z = self.zero_order
        # Left of the picture is its first texel. What the B-spline smooths off is Z'' h^2 / 6.
        around = np.concatenate([z[:1], z, past_end(z)[None]])
        return bspline.read_curve(around, np.asarray(w, float) / 2 * (len(z) - 1) + 1)

    def kernel(self, u: np.ndarray, v: np.ndarray, variance=0.0) -> np.ndarray:
        """The coherence kernel (n,) that carries the zero order, wider by a variance in (u, v)."""
        variance = self.sigma_b**2 + variance
        return np.exp(-(u**2 + v**2) / (2 * variance)) / (2 * np.pi * variance)

    def albedo_bound_at(self, directions: np.ndarray) -> np.ndarray:
        """max(1, albedo) (...,) for directions (..., 3): the energy-conserving form divides f by the greater of the
        light's and the view's."""
        return albedo_bound(self.excess_albedo, directions)

    def candidate(self, u, v, w) -> tuple[np.ndarray, np.ndarray]:
        """The bake as metric.measure wants it."""
        return self.scattered_over_w2(u, v, w), self.zero_order_xyz(w)


def held_region(axes: tuple[np.ndarray, np.ndarray]) -> Region:
    """What a tile whose texels' middles are at v, u holds: from its first texel that is not padding to its last."""
    v, u = (axis[[TILE_PADDING, -1 - TILE_PADDING]] for axis in axes)
    return Region(tuple(u.tolist()), tuple(v.tolist()))


def level_mix(added, levels: int) -> tuple[np.ndarray, np.ndarray]:
    """The level (n,) under a kernel whose variance is larger by added (n,) times sigma_b^2, and the share (n,) of the
    level after it: the mixture of both has that variance. Beyond the last level, the last."""
    grown = np.clip(1 + np.asarray(added, float), 1, 4.0 ** (levels - 1))
    level = np.minimum(np.log2(grown) / 2, max(levels - 2, 0)).astype(int)
    return level, (grown / 4.0**level - 1) / 3


def past_end(curve: np.ndarray) -> np.ndarray:
    """What stands after the last sample (channels,) of a curve (n, channels), in line with its last two."""
    return 2 * curve[-1] - curve[-2]
