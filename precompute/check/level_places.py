# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the tiles of a bake's blur levels in its picture, independently of the code that packs them.

Each level has texels 1 / r times as large as the level before, with r = 1 / sqrt(ratio). The tiles of a term stand side
by side on two shelves. Tile l begins at the rounded-down place A (1 - r^l) / (1 - r) + 6 l + phase, where A is the
number of inner columns less 1. The phase makes the fractions of these places as far from 0 as possible. The lower shelf
has as many tiles as make the cell smallest.
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


def places_of(inner: tuple[int, int], levels: int, ratio: float) -> tuple[list[Place], tuple[int, int]]:
    """The places of all levels' tiles, and rows and columns of the cell, for `inner` rows and columns of level 0."""
    r = ratio**-0.5
    tiles = [[math.ceil((count - 1) * r**level - 1e-9) + 1 + 2 * _RIM for count in inner] for level in range(levels)]
    begins = [(inner[1] - 1) * (1 - r**level) / (1 - r) + _BESIDE * level for level in range(levels + 1)]
    phase = _phase([each % 1 for each in begins])
    columns = [math.floor(each + phase) for each in begins]
    sizes = [_size(tiles, columns, shelf) for shelf in range(1, levels + 1)]
    size = min(sizes, key=math.prod)
    shelf = 1 + sizes.index(size)
    places = [
        Place(tiles[0][0] * (level >= shelf), columns[level] - columns[shelf] * (level >= shelf), *tiles[level])
        for level in range(levels)
    ]
    return places, size


def _phase(fractions: list[float]) -> float:
    """What moves the middle of the widest gap between fractions, around a circle, to 0."""
    ascending = sorted(fractions)
    gaps = [after - before for before, after in zip(ascending, [*ascending[1:], ascending[0] + 1], strict=True)]
    widest = gaps.index(max(gaps))
    return -(ascending[widest] + gaps[widest] / 2) % 1


def _size(tiles: list[list[int]], columns: list[int], shelf: int) -> tuple[int, int]:
    """Rows and columns of a cell with `shelf` tiles on the lower shelf."""
    if shelf == len(tiles):
        return tiles[0][0], columns[shelf]
    return tiles[0][0] + tiles[shelf][0], max(columns[shelf], columns[-1] - columns[shelf])
