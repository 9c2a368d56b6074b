# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the tiles of a table and of its wider levels stand in one picture.

A kernel between those of two levels is a mixture of both. The nearer the levels, the truer is the mixture, and the more
memory they take. Let R be the ratio of the variances of a level's kernel and the kernel of the level before, and
r = 1 / sqrt(R). Level l has the kernel sigma_b / r^l, and texels that are 1 / r^l times as large as those of level 0.
Its tile has ceil((inner - 1) r^l) + 1 inner texels along an axis; the first is at the same (u, v) on every level. On
each side there are TILE_PADDING more texels, which a cubic reading between inner texels uses.

Each term has a cell of the picture, and all cells are alike. The tiles of a term's levels stand in its cell on two
shelves: the first levels on the lower shelf from left to right, the others above them, again from the left.

Which level is read depends on the point that is shaded, so a material computes a tile's place while it shades.
Therefore every place has a closed form in l and r^l. Let A be the number of inner columns less 1. If all levels stood
on one shelf, level l would begin at the column

    X(l) = floor(A (1 - r^l) / (1 - r) + COLUMNS_BESIDE l + phase)

X(l + 1) - X(l) is at least floor(A r^l) + COLUMNS_BESIDE, which is no less than the columns of a tile. The phase, from
0 to 1, keeps each number that is rounded down as far from a whole number as one phase can, so that the powers of a
graphics card, which are right to six digits, are rounded like those here. Levels on the upper shelf stand where they
would on one shelf, moved by the columns of the lower shelf to the left and by its rows upward.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.failure import GratingError, Setting

# Texels on each side of a tile that a cubic reading of its inner texels uses.
TILE_PADDING = 2
# The padding on both sides, the first inner texel, and one for the rounding down of the columns where tiles begin.
COLUMNS_BESIDE = 2 * TILE_PADDING + 2
# The ratios of the variances of two levels. The smallest one is taken whose picture takes no more than FINE_BYTES, or
# else the largest. With the rows beside the tiles, and an empty cell beside seven, that is within the 128 MiB for which
# a coherence is chosen. Midway between two levels the 99th percentile of the dE00 is 2, 5 and 17 on sample:blazed
# (`./dev bench levels`).
RATIOS = 1.5, 2.0, 4.0
FINE_BYTES = 110 << 20
# More levels than any table has: with the smallest ratio, 52 levels lead from a kernel of 8e-6 to one of 0.25.
LEVELS_MAX = 64
# The side of a picture that every graphics card of today takes.
PICTURE_SIDE_MAX = 16384
# The longer side of a picture over its shorter side, at most, where the tiles allow it.
ASPECT_MAX = 3.0
# The most terms of a table. Light that returns from heights d apart changes with w as exp(2 pi i w d / lambda), and its
# colour, the sum over the observer's wavelengths, is a sum of 89 Chebyshev polynomials of w to an error of 1e-5 for a
# d of 5 um. No relief that diffracts is half as deep. The time that Blender takes to make the nodes of a material grows
# as the square of this number, and is some seconds for 64.
TERMS_MAX = 96
# Blender holds a picture as RGBA of 32 bits a channel.
BYTES_PER_TEXEL = 16
# The standard deviation in (u, v) of the widest kernel that lights and roughness ask for, and the fewest inner texels
# along an axis that still show a kernel.
_WIDEST_KERNEL, _INNER_MIN = 0.25, 8

# Rows and columns, or x and y.
Pair = tuple[int, int]


@dataclass(frozen=True)
class Cell:
    """A term's part of the picture, for tables of `inner` inner rows and columns on level 0 and a number of levels."""

    inner: Pair
    levels: int
    ratio: float

    @property
    def shrink(self) -> float:
        """r, by which the number of texels along an axis shrinks from one level to the next."""
        return self.ratio**-0.5

    @property
    def geometric(self) -> float:
        """A / (1 - r)."""
        return (self.inner[1] - 1) / (1 - self.shrink)

    @cached_property
    def phase(self) -> float:
        """The phase of the columns where tiles begin: the middle of the widest gap that their fractions leave."""
        fractions = np.sort([self._unrounded(level) % 1 for level in range(self.levels + 1)])
        gaps = np.diff(fractions, append=fractions[0] + 1)
        widest = int(np.argmax(gaps))
        return float(-(fractions[widest] + gaps[widest] / 2) % 1)

    @cached_property
    def shelf(self) -> int:
        """The number of levels on the lower shelf: that for which the cell is smallest."""
        return min(range(1, self.levels + 1), key=lambda count: math.prod(self._size(count)))

    @property
    def size(self) -> Pair:
        """Rows and columns of the picture."""
        return self._size(self.shelf)

    @property
    def upper(self) -> Pair:
        """By how many columns to the left, and rows upward, the upper shelf stands of where one shelf would go on."""
        return self._column(self.shelf), self.inner[0] + 2 * TILE_PADDING

    def inner_of(self, level: int) -> Pair:
        """Inner rows and columns of a level."""
        # The level's size may be a whole number but for rounding.
        rows, columns = (math.ceil((n - 1) * self.shrink**level - 1e-9) + 1 for n in self.inner)
        return rows, columns

    def corner(self, level: int) -> Pair:
        """Lower left texel (x, y) of a level's tile, its padding included, counted from that of the cell."""
        left, upward = self.upper if level >= self.shelf else (0, 0)
        return self._column(level) - left, upward

    def _unrounded(self, level: int) -> float:
        return self.geometric * (1 - self.shrink**level) + COLUMNS_BESIDE * level

    def _column(self, level: int) -> int:
        return math.floor(self._unrounded(level) + self.phase)

    def _size(self, shelf: int) -> Pair:
        """Rows and columns with `shelf` levels on the lower shelf."""
        rows, columns = self.inner[0] + 2 * TILE_PADDING, self._column(shelf)
        if shelf == self.levels:
            return rows, columns
        return rows + self.inner_of(shelf)[0] + 2 * TILE_PADDING, max(columns, self._column(self.levels) - columns)


def cell_for(
    terms: int, inner: Pair, sigma_b: float, *, whole: Pair | None = None, ratios: tuple[float, ...] = RATIOS
) -> Cell:
    """The cell of a table's terms: how many levels it has, and how near they are to each other.

    `whole` is the number of inner rows and columns that the table would have if it held every direction; by default it
    does. Of the ratios, which ascend, the first is taken for which the picture of that whole table is small enough, or
    else the last. So a part takes less memory than a whole table of such texels, and is as true. The last level is the
    first level whose kernel is as wide as lights and roughness ever ask for, or the last level that still has
    _INNER_MIN inner texels along each axis, whichever comes first."""

    def cell(inner: Pair, ratio: float) -> Cell:
        wanted = math.ceil(math.log(_WIDEST_KERNEL / sigma_b, ratio) * 2 - 1e-9)
        held = math.floor(math.log(max(min(inner) - 1, 1) / (_INNER_MIN - 1), ratio) * 2)
        return Cell(inner, 1 + max(0, min(wanted, held)), ratio)

    def is_small(ratio: float) -> bool:
        return terms * math.prod(cell(whole or inner, ratio).size) * BYTES_PER_TEXEL <= FINE_BYTES

    return cell(inner, next(filter(is_small, ratios), ratios[-1]))


def grid(terms: int, cell: Pair, *, width_min: int = 1) -> Pair:
    """Rows and columns of cells of the best picture that holds `terms` terms, each in a cell of rows and columns.

    A picture must be at least `width_min` wide, and no side may exceed PICTURE_SIDE_MAX. A picture whose longer side is
    at most ASPECT_MAX times its shorter side is better than any other. Among such pictures the smallest is the best,
    and among pictures of equal size the squarest.

    Raises GratingError for more than TERMS_MAX terms, and if every picture is too large for a graphics card."""
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
