# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of a surface, as a bake stores it and a renderer reads it.

    XYZ(u, v, w) = Z(w) * kernel(u, v) + w^2 * sum_k f_k(t) B_k(u, v),     f_k(t) = sum_j basis_kj T_j(t)

(u, v, w) = wi + wr is the sum of the unit vectors to the light and to the viewer. Z is the colour of the zero order,
the mirror image, and the kernel is the Gaussian by which coherence blurs it. T_j is the Chebyshev polynomial of degree
j, and t runs from -1 to 1 over the table's range of w. The f_k are functions learnt from the surface
(bake/levels_and_basis.py), or the polynomials themselves. The B_k are the tiles. docs/theory.md explains the series in
"Expansions" and "The bake".

A table for lamps of several spectra has more channels than X, Y and Z (colour/channels.py), which come first. What
reads the table reads XYZ, except `under` and `channels_over_w2`.

One picture holds the table's tiles and those of its wider blur levels (blur_levels.py)."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice

import numpy as np

from ..colour.channels import lamp_matrix
from ..maths import bspline, chebyshev
from ..optics.brdf import NO_RATIO
from ..optics.coherence import coherence_length
from ..optics.plate import NO_PLATE
from ..optics.region import Region
from .blur_levels import TILE_PADDING, Cell, Spacing, level_mix
from .plate_gains import PlateGains

# Number of samples of Z(w). Reading by B-splines is then off by half a step of a half float for a relief of 2 um.
ZERO_ORDER_SAMPLES = 512
# How far a sum of two unit vectors may cross the end of a range by rounding.
_ROUNDING = 1e-9
# Number of places read at once, whose indices and weights fit into a core's cache.
_READ_AT_ONCE = 4096
_Number = np.ndarray | float


@dataclass(frozen=True)
class Table:
    """A relief's table.

    terms          (K, rows, columns, channels) float32, the B_k; the first axis of a tile runs along +v, the second
                   along +u. The outermost TILE_PADDING texels on each side serve interpolation only
    zero_order     (n, channels), Z at n equal steps of w from 0 to 2, ends included
    sigma_b        the standard deviation of the coherence kernel in (u, v)
    texel          the step of u and v per texel
    illuminant     what counts as white
    ratio_ior      the index of the ratio form, if the table holds its matter's reflectance; else NO_RATIO
                   (optics/brdf.py)
    first          (v, u) at the centre of texel (0, 0); by default the tile's centre is at (v, u) = (0, 0)
    w_range        the range of w that t runs over
    precision      the kind of float that holds the terms well enough in a file
    wider          the same terms on wider blur levels, with texels scaled accordingly
    spacing        how far apart the levels are
    coarser        the factor of the texels of all wider levels
    basis          (K, J), the functions f_k as coefficients of T_0 to T_(J-1); None: f_k is T_k
    plate_ior      the index of a plate over the relief, or 1. u, v, w and sigma_b are then those of the directions
                   inside the plate (optics/plate.py)
    largest_albedo the largest share of luminance that the surface would send back, at least 1. Terms and zero order
                   are divided by it (bake/largest_albedo.py)
    gains          what the plate gives back of the light that it traps (plate_gains.py); None without a plate
    """

    terms: np.ndarray
    zero_order: np.ndarray
    sigma_b: float
    texel: float
    illuminant: str
    ratio_ior: float = NO_RATIO
    first: tuple[float, float] = None  # type: ignore[assignment]  # __post_init__ fills it in
    w_range: tuple[float, float] = (0.0, 2.0)
    precision: type[np.floating] = np.float16
    wider: tuple[np.ndarray, ...] = ()
    spacing: Spacing = Spacing()
    coarser: float = 1.0
    basis: np.ndarray = None  # type: ignore[assignment]  # __post_init__ fills it in
    plate_ior: float = NO_PLATE
    largest_albedo: float = 1.0
    gains: PlateGains | None = None

    def __post_init__(self) -> None:
        if self.basis is None:
            object.__setattr__(self, "basis", np.eye(len(self.terms)))
        if self.first is None:
            object.__setattr__(self, "first", tuple((1 - n) / 2 * self.texel for n in self.terms.shape[1:3]))

    @property
    def holds_reflectance(self) -> bool:
        """Whether the table holds its matter's reflectance; a dielectric's does not."""
        return self.ratio_ior != NO_RATIO

    @property
    def tile(self) -> tuple[int, int]:
        """Rows and columns of a term's tile."""
        return self.terms.shape[1:3]

    @property
    def inner(self) -> tuple[int, int]:
        """Rows and columns of a tile without its padding."""
        rows, columns = self.tile
        return rows - 2 * TILE_PADDING, columns - 2 * TILE_PADDING

    @property
    def levels(self) -> tuple[np.ndarray, ...]:
        """The terms of every blur level. Level l has a kernel of variance sigma_b^2 spacing.grown(l)."""
        return self.terms, *self.wider

    @cached_property
    def cell(self) -> Cell:
        """The cell of a term in the picture."""
        return Cell(self.inner, len(self.levels), self.spacing, self.coarser)

    @property
    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """v (rows,) and u (columns,) at the texels' centres."""
        v, u = (first + np.arange(n) * self.texel for first, n in zip(self.first, self.tile, strict=True))
        return v, u

    @property
    def region(self) -> Region:
        """The region of (u, v) that the table holds. A reading outside gives the value at the region's rim."""
        return held_region(self.axes)

    def holds(self, u: np.ndarray, v: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Whether the table holds the light at u, v and w (n,), up to rounding; boolean (n,). Elsewhere a renderer
        shows black, because the table would repeat its rim."""
        (u_low, u_high), (v_low, v_high), (w_low, w_high) = *self.region, self.w_range
        region = Region((u_low - _ROUNDING, u_high + _ROUNDING), (v_low - _ROUNDING, v_high + _ROUNDING))
        return region.contains(u, v) & (w >= w_low - _ROUNDING) & (w <= w_high + _ROUNDING)

    def under(self, lamp: str) -> "Table":
        """The table of XYZ under a lamp. The lamp's matrix gives it from the channels (colour/channels.py)."""
        matrix = lamp_matrix(self.illuminant, lamp).T.astype(np.float32)
        own = (each @ matrix for each in self.levels)
        gains = None if self.gains is None else self.gains.under(matrix)
        zero_order = self.zero_order @ matrix
        return replace(self, terms=next(own), wider=tuple(own), zero_order=zero_order, illuminant=lamp, gains=gains)

    def scattered_over_w2(self, u: np.ndarray, v: np.ndarray, w: _Number, *, variance: _Number = 0.0) -> np.ndarray:
        """Scattered XYZ over w^2 (n, 3) at u and v (n,), as a renderer reads it: see channels_over_w2."""
        return self.channels_over_w2(u, v, w, variance=variance, channels=3)

    def channels_over_w2(
        self, u: np.ndarray, v: np.ndarray, w: _Number, *, variance: _Number = 0.0, channels: int | None = None
    ) -> np.ndarray:
        """Channels over w^2 (n, channels) of the scattered light at u and v (n,): all, or the first `channels`.

        Texels are read by cubic B-splines. `w` is a number or (n,). `variance`, a number or (n,) in (u, v), is added to
        the kernel's variance. The result is then a mixture of two blur levels: the last whose kernel's variance is at
        most the sum, and the next, if any."""
        w, variance = (np.broadcast_to(np.asarray(each, float), np.shape(u)) for each in (w, variance))
        level, share = level_mix(variance / self.sigma_b**2, len(self.levels), spacing=self.spacing)
        channels = channels or self.terms.shape[-1]
        out = np.zeros((channels, len(u)))
        for which in range(len(self.levels)):
            part = np.where(level == which, 1 - share, np.where(level == which - 1, share, 0.0))
            lit = np.flatnonzero(part)
            for start in range(0, len(lit), _READ_AT_ONCE):
                at = lit[start : start + _READ_AT_ONCE]
                out[:, at] += part[at] * self._read(which, u[at], v[at], w[at], channels)
        return out.T

    def _read(self, level: int, u: np.ndarray, v: np.ndarray, w: np.ndarray, channels: int) -> np.ndarray:
        """The first channels over w^2 (channels, n) of one blur level, in the terms' own precision."""
        low, high = self.w_range
        t = np.clip((2 * w - low - high) / (high - low), -1, 1).astype(self.terms.dtype)
        out = np.zeros((channels, len(u)), self.terms.dtype)
        for function, term in zip(self.functions(t), self._read_terms(level, u, v, channels), strict=True):
            for c, channel in enumerate(term):
                out[c] += function * channel
        return out

    def functions(self, t: np.ndarray) -> np.ndarray:
        """The functions f_k (K, n) at t (n,) in [-1, 1], in the precision of t."""
        polynomials = islice(chebyshev.recurrence(t), self.basis.shape[1])
        return self.basis.astype(t.dtype) @ np.stack(list(polynomials))

    def at_w(self, w: float) -> np.ndarray:
        """XYZ over w^2 (rows, columns, 3) at the texels of blur level 0."""
        low, high = self.w_range
        functions = self.functions(np.array([(2 * w - low - high) / (high - low)]))[:, 0]
        return np.tensordot(functions, self.terms[..., :3], axes=1)

    def _read_terms(self, level: int, u: np.ndarray, v: np.ndarray, channels: int) -> Iterator[Iterator[np.ndarray]]:
        """Yield the terms of one blur level, each as its first channels (n,), which are sums over the B-spline's
        texels."""
        terms = self.levels[level]
        _, rows, columns, held = terms.shape
        (u_low, u_high), (v_low, v_high) = self.region
        texel = self.texel * self.cell.texels(level)
        x, y = (np.clip(u, u_low, u_high) - u_low) / texel, (np.clip(v, v_low, v_high) - v_low) / texel
        places, weights = bspline.patches(
            y + TILE_PADDING, x + TILE_PADDING, (rows, columns), precision=terms.dtype.type
        )
        # Indices of X in a flattened term. Y, Z and the other channels follow it.
        places *= held
        for term in terms.reshape(len(terms), -1):
            # All indices are within the term; of NumPy's modes, wrapping is the fastest.
            yield (np.einsum("mn,mn->n", weights, term[c:].take(places, mode="wrap")) for c in range(channels))

    def zero_order_xyz(self, w: _Number) -> np.ndarray:
        """Z (..., 3) at w (...,), read by a cubic B-spline as in a renderer."""
        z = self.zero_order[:, :3]
        # Left of the picture, a renderer repeats the first texel. For samples at steps h, the B-spline is off by Z''
        # h^2 / 6, where Z'' is the second derivative of Z.
        around = np.concatenate([z[:1], z, past_end(z)[None]])
        return bspline.read_curve(around, np.asarray(w, float) / 2 * (len(z) - 1) + 1)

    def kernel(self, u: np.ndarray, v: np.ndarray, variance: _Number = 0.0) -> np.ndarray:
        """The coherence kernel (n,) of the zero order, widened by a variance in (u, v)."""
        variance = self.sigma_b**2 + variance
        return np.exp(-(u**2 + v**2) / (2 * variance)) / (2 * np.pi * variance)

    @property
    def coherence_length_m(self) -> float:
        """The coherence length in metres: that of the kernel above a plate, which is wider by the plate's index."""
        return coherence_length(self.sigma_b * self.plate_ior)

    @property
    def kernel_variance(self) -> float:
        """The variance in rad2 of the coherence kernel above a plate. A lamp's disc of this variance adds no blur."""
        return (self.sigma_b * self.plate_ior) ** 2

    def candidate(self, u: np.ndarray, v: np.ndarray, w: _Number) -> tuple[np.ndarray, np.ndarray]:
        """The bake as a candidate of measure/errors.py: scattered XYZ over w^2 (n, 3), and the zero order's XYZ."""
        return self.scattered_over_w2(u, v, w), self.zero_order_xyz(w)


def held_region(axes: tuple[np.ndarray, np.ndarray]) -> Region:
    """The region of (u, v) of a tile without its padding, from the coordinates (v, u) of its texels' centres."""
    v, u = (axis[[TILE_PADDING, -1 - TILE_PADDING]] for axis in axes)
    return Region(tuple(u.tolist()), tuple(v.tolist()))


def past_end(curve: np.ndarray) -> np.ndarray:
    """Extrapolate a curve (n, channels) by one sample (channels,), on the line through the last two."""
    return 2 * curve[-1] - curve[-2]
