# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of a surface, as a bake stores it and a renderer reads it, and the places of its tiles in the picture.

    XYZ(u, v, w) = Z(w) * kernel(u, v) + w^2 * sum_k f_k(t) B_k(u, v),     f_k(t) = sum_j basis_kj T_j(t)

(u, v, w) = wi + wr is the sum of the unit vectors to the light and to the viewer. Z is the colour of the zero order,
the mirror image, and the kernel is the Gaussian by which coherence blurs it. T_j is the Chebyshev polynomial of degree
j, and t runs from -1 to 1 over the table's range of w. The f_k are functions learnt from the surface
(bake/levels_and_basis.py), or the polynomials themselves. The B_k are the tiles. docs/theory.md explains the series in
"Expansions" and "The bake".

A table for lamps of several spectra has more channels than X, Y and Z (colour/channels.py), which come first. What
reads the table reads XYZ, except `under` and `channels_over_w2`.

One picture holds the table's tiles and those of its wider blur levels. A kernel between two levels is read as a mixture
of both. Closer levels make the mixture more accurate and take more memory. The first levels take the most memory, and a
mixture of two wide kernels errs most. So the levels are far apart first, and closer later: level l has a kernel of the
variance

    V(l) = sigma_b^2 ((1 + c) R^l - c)

with the ratio R and the offset c (Spacing). Let r = 1 / sqrt(R). All levels but level 0 have texels k / r^l times as
large as those of level 0, with the same k, at which level 1 just resolves its kernel. The tile of such a level has
ceil((inner - 1) r^l / k) + 1 inner texels along an axis; the first is at the same (u, v) on every level. On each side
there are TILE_PADDING more texels for cubic interpolation.

Each term has a cell of the picture, and all cells are alike. In a cell, the tiles of the levels are on two shelves: the
first levels on the lower shelf from left to right, the others above them, from the left or from where level 1 begins.

The shaded point decides which level is read, so a material computes a tile's place while it shades. Therefore every
place has a closed form in l and r^l. Let A be the number of inner columns less 1. On one shelf, level 0 begins at the
column 0, and level l at

    X(l) = floor(A + A (r - r^l) / (1 - r) / k + COLUMNS_BESIDE l + phase)

X(l + 1) - X(l) is at least floor(A r^l / k) + COLUMNS_BESIDE, which is no less than the columns of a tile. The phase,
from 0 to 1, keeps all numbers that are rounded down as far from integers as possible. So they round alike on a graphics
card, which computes powers to six digits only. Levels on the upper shelf are moved left, and up by the rows of the tile
above which they begin."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from typing import NamedTuple

import numpy as np

from ..base.failure import GratingError, Setting
from ..colour.channels import lamp_matrix
from ..maths import bspline, chebyshev
from ..optics.brdf import NO_RATIO
from ..optics.coherence import coherence_length
from ..optics.plate import NO_PLATE
from ..optics.region import Region
from .plate_gains import PlateGains

# Texels on each side of a tile that a cubic reading of its inner texels uses.
TILE_PADDING = 2
# The padding on both sides, the first inner texel, and one for rounding down the columns where tiles begin.
COLUMNS_BESIDE = 2 * TILE_PADDING + 2
# The greatest factor k of the texels of the wider levels.
COARSER_MAX = 4.0
# More levels than any table has: with the smallest ratio, 52 levels lead from a kernel of 8e-6 to one of 0.25.
LEVELS_MAX = 64
# The side of a picture that every current graphics card accepts.
PICTURE_SIDE_MAX = 16384
# The preferred greatest aspect ratio of a picture.
ASPECT_MAX = 3.0
# The greatest number of terms. Light from heights d apart changes with w as exp(2 pi i w d / lambda). Its colour,
# summed over wavelengths, is a sum of 89 Chebyshev polynomials of w to an error of 1e-5 for d = 5 um, more than twice
# the depth of any relief that diffracts. Blender's time to build a material grows as the square: some seconds for 64.
TERMS_MAX = 96
# Blender holds a picture as RGBA of 32 bits a channel.
BYTES_PER_TEXEL = 16
# The widest kernel's standard deviation in (u, v), and the fewest inner texels along an axis that resolve a kernel.
_WIDEST_KERNEL, _INNER_MIN = 0.25, 8

# Rows and columns, or x and y.
Pair = tuple[int, int]


class Spacing(NamedTuple):
    """How far apart blur levels are: the ratio R and the offset c of their kernels' variances."""

    ratio: float = 4.0
    offset: float = 0.5

    def grown(self, level: float) -> float:
        """The variance of a level's kernel over that of level 0."""
        return 1 + (1 + self.offset) * (self.ratio**level - 1)

    def level_of(self, grown: float) -> float:
        """The place between the levels of a kernel of `grown` times the variance of level 0's."""
        return math.log(1 + (grown - 1) / (1 + self.offset), self.ratio)

    @property
    def stretch(self) -> float:
        """The factor k with which level 1 has as many texels to its kernel as level 0. Wider levels then have more."""
        return math.sqrt(self.grown(1) / self.ratio)


# From close to far. The first is used whose picture fits into FINE_BYTES, or else the last. With the rows beside the
# tiles, and an empty cell beside seven, that is within the 128 MiB for which a coherence is chosen.
SPACINGS = (Spacing(1.5, 0.25), *(Spacing(ratio, 0.5) for ratio in (1.5, 1.6, 1.7, 1.9, 2.2, 2.8, 4.0)))
FINE_BYTES = 90 << 20


@dataclass(frozen=True)
class Cell:
    """A term's part of the picture, for `inner` inner rows and columns on level 0 and a number of blur levels.

    `coarser` is the factor k of the texels of all levels but level 0."""

    inner: Pair
    levels: int
    spacing: Spacing
    coarser: float = 1.0

    @property
    def shrink(self) -> float:
        """r, by which the number of texels along an axis shrinks from one level to the next."""
        return self.spacing.ratio**-0.5

    def texels(self, level: int) -> float:
        """The size of a level's texels in those of level 0."""
        return self.coarser * self.shrink**-level if level else 1.0

    @property
    def geometric(self) -> float:
        """A / (1 - r): how fast a tile's column falls with its number of texels along an axis over level 0's."""
        return (self.inner[1] - 1) / (1 - self.shrink)

    @property
    def column_end(self) -> float:
        """The column, without COLUMNS_BESIDE, where the last of endless wider levels would end."""
        return self.inner[1] - 1 + self.geometric * self.shrink / self.coarser

    @cached_property
    def phase(self) -> float:
        """The phase of the columns where tiles begin: the centre of the widest gap between their fractions."""
        fractions = np.sort([column % 1 for column in self._unrounded])
        gaps = np.diff(fractions, append=fractions[0] + 1)
        widest = int(np.argmax(gaps))
        return float(-(fractions[widest] + gaps[widest] / 2) % 1)

    @cached_property
    def shelves(self) -> Pair:
        """The number of levels on the lower shelf, and the level above which the upper shelf begins, 0 or 1, that make
        the cell smallest."""
        found = [(count, above) for count in range(1, self.levels + 1) for above in (0, 1) if above < count]
        return min(found, key=lambda shelves: math.prod(self._size(*shelves)))

    @property
    def shelf(self) -> int:
        """The number of levels on the lower shelf."""
        return self.shelves[0]

    @property
    def size(self) -> Pair:
        """Rows and columns of the cell."""
        return self._size(*self.shelves)

    @property
    def upper(self) -> Pair:
        """The shift of the upper shelf from a single shelf: columns to the left, and rows upward."""
        shelf, above = self.shelves
        return self._columns[shelf] - self._columns[above], self._rows[above]

    def inner_of(self, level: int) -> Pair:
        """Inner rows and columns of a level."""
        # A level's size may be an integer up to rounding.
        rows, columns = (math.ceil((n - 1) / self.texels(level) - 1e-9) + 1 for n in self.inner)
        return rows, columns

    def corner(self, level: int) -> Pair:
        """Lower left texel (x, y) of a level's tile, including its padding, counted from the cell's."""
        left, upward = self.upper if level >= self.shelf else (0, 0)
        return self._columns[level] - left, upward

    @cached_property
    def _unrounded(self) -> list[float]:
        end, geometric = self.column_end, self.geometric
        wider = range(1, self.levels + 1)
        return [0.0, *(end - geometric / self.texels(level) + COLUMNS_BESIDE * level for level in wider)]

    @cached_property
    def _columns(self) -> list[int]:
        return [math.floor(column + self.phase) for column in self._unrounded]

    @cached_property
    def _rows(self) -> list[int]:
        return [self.inner_of(level)[0] + 2 * TILE_PADDING for level in range(self.levels)]

    def _size(self, shelf: int, above: int) -> Pair:
        """Rows and columns with `shelf` levels on the lower shelf, and the others above it from level `above` on."""
        rows, columns = self._rows[0], self._columns[shelf]
        if shelf == self.levels:
            return rows, columns
        upper = self._columns[above] + self._columns[self.levels] - columns
        return max(rows, self._rows[above] + self._rows[shelf]), max(columns, upper)


def cell_for(
    terms: int, inner: Pair, sigma_b: float, *, whole: Pair | None = None, spacings: Sequence[Spacing] = SPACINGS,
    coarser: float = 1.0,
) -> Cell:  # fmt: skip
    """Choose the number and spacing of blur levels for a table's terms, and return their cell.

    `whole` is the number of inner rows and columns of a table of every direction; by default the table is one. The
    first of the spacings is used for which the picture of this whole table is small enough, or else the last. So a part
    takes less memory than a whole table of the same texels, and is as accurate. The last level is the first with a
    kernel as wide as lights and roughness need, or the last with _INNER_MIN inner texels along each axis, whichever
    comes first. The wider levels have at least 1 / coarser times as many texels to a kernel as level 0."""

    def cell(inner: Pair, spacing: Spacing) -> Cell:
        k = min(coarser * spacing.stretch, COARSER_MAX)
        wanted = math.ceil(spacing.level_of(max(_WIDEST_KERNEL / sigma_b, 1.0) ** 2) - 1e-9)
        held = math.floor(math.log(max(min(inner) - 1, 1) / (k * (_INNER_MIN - 1)), spacing.ratio) * 2)
        return Cell(inner, 1 + max(0, min(wanted, held)), spacing, k)

    def is_small(spacing: Spacing) -> bool:
        return terms * math.prod(cell(whole or inner, spacing).size) * BYTES_PER_TEXEL <= FINE_BYTES

    return cell(inner, next(filter(is_small, spacings), spacings[-1]))


def grid(terms: int, cell: Pair, *, width_min: int = 1) -> Pair:
    """Rows and columns of cells of the best picture that holds `terms` terms, each in a cell of rows and columns.

    A picture must be at least `width_min` wide, and no side may exceed PICTURE_SIDE_MAX. Pictures with an aspect ratio
    up to ASPECT_MAX are preferred, then the smallest, then the squarest.

    Raises GratingError for more than TERMS_MAX terms, or if every picture is too large for a graphics card."""
    if terms > TERMS_MAX:
        raise GratingError(
            f"a table of {terms} terms, for a relief too deep or a colour error too small",
            f"a material reads at most {TERMS_MAX}",
            ("ask for a larger ", Setting.DELTA_E, ", or crop the scan to a shallower part"),
        )
    found = []
    for columns in range(1, terms + 1):
        rows = math.ceil(terms / columns)
        short, long = sorted((rows * cell[0], max(columns * cell[1], width_min)))
        if long <= PICTURE_SIDE_MAX:
            found.append((max(long / short, ASPECT_MAX), short * long, long / short, (rows, columns)))
    if not found:
        raise GratingError(
            "",
            f"a table of {terms} tiles of {cell[1]} x {cell[0]} is larger than a graphics card takes",
            ("ask for a shorter ", Setting.COHERENCE_UM),
        )
    return min(found)[-1]


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


def level_mix(added: np.ndarray, levels: int, *, spacing: Spacing) -> tuple[np.ndarray, np.ndarray]:
    """The blur level (n,) to read, and the share (n,) of the next level, for a kernel wider than sigma_b.

    `added` (n,) is the variance added to the kernel's, in units of sigma_b^2. The mixture has the requested variance,
    up to the last level's. Materials leave wider lamps to a closure (addon/materials/lamp_choice.py)."""
    ratio = spacing.ratio
    # The variances plus the offset are a geometric sequence.
    grown = np.clip(1 + np.asarray(added, float) / (1 + spacing.offset), 1, ratio ** (levels - 1))
    level = np.minimum(np.log(grown) / math.log(ratio), max(levels - 2, 0)).astype(int)
    return level, (grown / ratio**level - 1) / (ratio - 1)


def past_end(curve: np.ndarray) -> np.ndarray:
    """Extrapolate a curve (n, channels) by one sample (channels,), on the line through the last two."""
    return 2 * curve[-1] - curve[-2]
