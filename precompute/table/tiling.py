# SPDX-License-Identifier: GPL-3.0-or-later
"""Places the tiles of a table and of its wider blur levels in one picture.

A kernel between two levels is read as a mixture of both. Closer levels make the mixture more accurate and take more
memory. Let R be the ratio of the variances of a level's kernel and the kernel of the level before, and r = 1 / sqrt(R).
Level l has the kernel sigma_b / r^l, and texels 1 / r^l times as large as those of level 0. Its tile has ceil((inner -
1) r^l) + 1 inner texels along an axis; the first is at the same (u, v) on every level. On each side there are
TILE_PADDING more texels for cubic interpolation.

Each term has a cell of the picture, and all cells are alike. In a cell, the tiles of the levels are on two shelves: the
first levels on the lower shelf from left to right, the others above them, again from the left.

The shaded point decides which level is read, so a material computes a tile's place while it shades. Therefore every
place has a closed form in l and r^l. Let A be the number of inner columns less 1. On one shelf, level l begins at the
column

    X(l) = floor(A (1 - r^l) / (1 - r) + COLUMNS_BESIDE l + phase)

X(l + 1) - X(l) is at least floor(A r^l) + COLUMNS_BESIDE, which is no less than the columns of a tile. The phase, from
0 to 1, keeps all numbers that are rounded down as far from integers as possible. So they round alike on a graphics
card, which computes powers to six digits only. Levels on the upper shelf are moved left by the lower shelf's columns
and up by its rows.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..base.failure import GratingError, Setting

# Texels on each side of a tile that a cubic reading of its inner texels uses.
TILE_PADDING = 2
# The padding on both sides, the first inner texel, and one for rounding down the columns where tiles begin.
COLUMNS_BESIDE = 2 * TILE_PADDING + 2
# The ratios of the variances of two levels. The smallest ratio is used whose picture fits into FINE_BYTES, or else the
# largest. With the rows beside the tiles, and an empty cell beside seven, that is within the 128 MiB for which a
# coherence is chosen. Midway between levels the dE00's p99 is 2, 5 and 17 on sample:blazed (`./dev bench levels`).
RATIOS = 1.5, 2.0, 4.0
FINE_BYTES = 110 << 20
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


@dataclass(frozen=True)
class Cell:
    """A term's part of the picture, for `inner` inner rows and columns on level 0 and a number of blur levels."""

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
        """The phase of the columns where tiles begin: the centre of the widest gap between their fractions."""
        fractions = np.sort([self._unrounded(level) % 1 for level in range(self.levels + 1)])
        gaps = np.diff(fractions, append=fractions[0] + 1)
        widest = int(np.argmax(gaps))
        return float(-(fractions[widest] + gaps[widest] / 2) % 1)

    @cached_property
    def shelf(self) -> int:
        """The number of levels on the lower shelf that makes the cell smallest."""
        return min(range(1, self.levels + 1), key=lambda count: math.prod(self._size(count)))

    @property
    def size(self) -> Pair:
        """Rows and columns of the cell."""
        return self._size(self.shelf)

    @property
    def upper(self) -> Pair:
        """The shift of the upper shelf from a single shelf: columns to the left, and rows upward."""
        return self._column(self.shelf), self.inner[0] + 2 * TILE_PADDING

    def inner_of(self, level: int) -> Pair:
        """Inner rows and columns of a level."""
        # A level's size may be an integer up to rounding.
        rows, columns = (math.ceil((n - 1) * self.shrink**level - 1e-9) + 1 for n in self.inner)
        return rows, columns

    def corner(self, level: int) -> Pair:
        """Lower left texel (x, y) of a level's tile, including its padding, counted from the cell's."""
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
    """Choose the number and ratio of blur levels for a table's terms, and return their cell.

    `whole` is the number of inner rows and columns of a table of every direction; by default the table is one. The
    first of the ascending ratios is used for which the picture of this whole table is small enough, or else the last.
    So a part takes less memory than a whole table of the same texels, and is as accurate. The last level is the first
    with a kernel as wide as lights and roughness need, or the last with _INNER_MIN inner texels along each axis,
    whichever comes first."""

    def cell(inner: Pair, ratio: float) -> Cell:
        wanted = math.ceil(math.log(_WIDEST_KERNEL / sigma_b, ratio) * 2 - 1e-9)
        held = math.floor(math.log(max(min(inner) - 1, 1) / (_INNER_MIN - 1), ratio) * 2)
        return Cell(inner, 1 + max(0, min(wanted, held)), ratio)

    def is_small(ratio: float) -> bool:
        return terms * math.prod(cell(whole or inner, ratio).size) * BYTES_PER_TEXEL <= FINE_BYTES

    return cell(inner, next(filter(is_small, ratios), ratios[-1]))


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
