# SPDX-License-Identifier: GPL-3.0-or-later
"""The blur levels of a table: how many there are and how wide, the places of their tiles in the picture, and which two
are mixed for a lamp.

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
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..base.failure import GratingError, Setting

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


def level_mix(added: np.ndarray, levels: int, *, spacing: Spacing) -> tuple[np.ndarray, np.ndarray]:
    """The blur level (n,) to read, and the share (n,) of the next level, for a kernel wider than sigma_b.

    `added` (n,) is the variance added to the kernel's, in units of sigma_b^2. The mixture has the requested variance,
    up to the last level's. Materials leave wider lamps to a closure (addon/materials/lamp_choice.py)."""
    ratio = spacing.ratio
    # The variances plus the offset are a geometric sequence.
    grown = np.clip(1 + np.asarray(added, float) / (1 + spacing.offset), 1, ratio ** (levels - 1))
    level = np.minimum(np.log(grown) / math.log(ratio), max(levels - 2, 0)).astype(int)
    return level, (grown / ratio**level - 1) / (ratio - 1)
