# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the tiles of a bake's blur levels in its picture, independently of the code that packs them.

With r = 1 / sqrt(ratio), each level but the first has texels `coarser` / r^l times as large as the first level's. The
tiles of a term stand side by side on two shelves. Tile l begins at the rounded-down place A + A (r + r^2 + ... +
r^(l-1)) / coarser + 6 l + phase, where A is the number of inner columns less 1; the first begins at 0. The phase makes
the fractions of these places as far from 0 as possible. The upper shelf begins above the first tile or above the
second. This, and the number of tiles on the lower shelf, are chosen so that the cell is smallest.
"""

import math
from dataclasses import dataclass

# Texels on each side of a tile's inner texels, and columns that a tile takes beside the A r^l of its inner texels.
_RIM, _BESIDE = 2, 6


@dataclass(frozen=True)
class Place:
    """A tile in its cell: its lowest row and leftmost column, and its rows and columns, all with its rim."""

    bottom: int
    left: int
    rows: int
    columns: int


def places_of(
    inner: tuple[int, int], levels: int, *, ratio: float, coarser: float
) -> tuple[list[Place], tuple[int, int]]:
    """The places of all levels' tiles, and rows and columns of the cell, for `inner` rows and columns of level 0."""
    r = ratio**-0.5
    shares = [1.0, *(r**level / coarser for level in range(1, levels))]
    tiles = [[math.ceil((count - 1) * share - 1e-9) + 1 + 2 * _RIM for count in inner] for share in shares]
    begins = [(inner[1] - 1) * math.fsum(shares[:level]) + _BESIDE * level for level in range(levels + 1)]
    phase = _phase([each % 1 for each in begins])
    columns = [math.floor(each + phase) for each in begins]
    shelves = [(shelf, above) for shelf in range(1, levels + 1) for above in range(min(shelf, 2))]
    shelf, above = min(shelves, key=lambda each: math.prod(_size(tiles, columns, *each)))
    up, left = tiles[above][0], columns[shelf] - columns[above]
    places = [
        Place(up * (level >= shelf), columns[level] - left * (level >= shelf), *tiles[level]) for level in range(levels)
    ]
    return places, _size(tiles, columns, shelf, above)


def _phase(fractions: list[float]) -> float:
    """What moves the middle of the widest gap between fractions, around a circle, to 0."""
    ascending = sorted(fractions)
    gaps = [after - before for before, after in zip(ascending, [*ascending[1:], ascending[0] + 1], strict=True)]
    widest = gaps.index(max(gaps))
    return -(ascending[widest] + gaps[widest] / 2) % 1


def _size(tiles: list[list[int]], columns: list[int], shelf: int, above: int) -> tuple[int, int]:
    """Rows and columns of a cell with `shelf` tiles on the lower shelf, and the others above from tile `above` on."""
    if shelf == len(tiles):
        return tiles[0][0], columns[shelf]
    rows = max(tiles[0][0], tiles[above][0] + tiles[shelf][0])
    return rows, max(columns[shelf], columns[above] + columns[-1] - columns[shelf])
