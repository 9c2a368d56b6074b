# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the compact bright parts of a picture of the world, which are brighter than their surroundings and not wide.

Pixels are added from the brightest down. A connected set of added pixels is a part that exceeds its surroundings, and
its excess is the light above them. Sets grow, meet and merge as in a component tree (Salembier, Oliveras and Garrido
1998, "Antiextensive connected operators for image and sequence processing"), until they are wider than a source may be.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from .panorama import Cells

# A bright part has at least this many times the radiance of its surroundings.
_CONTRAST = 2.0


@dataclass(frozen=True)
class Part:
    """A connected part of a picture.

    pixels      (n,) indices of its pixels
    base        the luminance of its surroundings
    excess      its light above the base, luminance x steradians"""

    pixels: np.ndarray
    base: float
    excess: float


@dataclass
class _Set:
    """A connected set of pixels, sums over the pixels, and the bright parts that met in the set."""

    area: float
    light: float
    light_squared: float
    moment: list[float]
    pixels: list[int]
    parts: list[Part] = field(default_factory=list)
    # False once the set grew too wide to be a part.
    is_open: bool = True

    def variance(self) -> float:
        x, y, z = self.moment
        return 1 - (x * x + y * y + z * z) ** 0.5 / self.area

    def take(self, other: _Set) -> None:
        self.area += other.area
        self.light += other.light
        self.light_squared += other.light_squared
        self.moment = [a + b for a, b in zip(self.moment, other.moment, strict=True)]
        self.pixels += other.pixels
        self.parts = self.parts + other.parts


class _Sets:
    """The connected sets of the pixels added so far, and the parts found in closed sets."""

    def __init__(self, least: float, widest: float) -> None:
        self._least, self._widest = least, widest
        self._parent: dict[int, int] = {}
        self._sets: dict[int, _Set] = {}
        self.found: list[Part] = []

    def add(self, pixel: int, alone: _Set, *, level: float, neighbours: Iterable[int]) -> None:
        """Add a pixel of luminance `level`, and join the sets that it touches."""
        self._parent[pixel], self._sets[pixel] = pixel, alone
        for neighbour in neighbours:
            if neighbour in self._parent:
                self._join(self._root(pixel), self._root(neighbour), level)
        grown = self._sets[self._root(pixel)]
        if grown.is_open and grown.variance() > self._widest:
            self._close(grown, level)

    def close_all(self, level: float) -> None:
        """Close all sets at the luminance `level` of the surroundings."""
        for grown in self._sets.values():
            self._close(grown, level)

    def _join(self, one: int, other: int, level: float) -> None:
        if one == other:
            return
        # The set with fewer pixels joins the other.
        into, gone = sorted((one, other), key=lambda root: -len(self._sets[root].pixels))
        large, small = self._sets[into], self._sets.pop(gone)
        self._parent[gone] = into
        if large.is_open and small.is_open:
            parts, others = (_resolved(grown, level, self._least) for grown in (large, small))
            large.take(small)
            if parts and others:
                large.parts = parts + others
        else:
            self._close(large, level)
            self._close(small, level)

    def _close(self, grown: _Set, level: float) -> None:
        if grown.is_open:
            self.found += _resolved(grown, level, self._least)
            grown.is_open, grown.pixels = False, []

    def _root(self, pixel: int) -> int:
        parent = self._parent
        while parent[pixel] != pixel:
            parent[pixel] = pixel = parent[parent[pixel]]
        return pixel


def compact_parts(luminance: np.ndarray, cells: Cells, *, least: float, widest: float) -> list[Part]:
    """Find the parts of a panorama's luminance (rows, cols), the greatest excess first. Each has an excess of at least
    `least` and, if it were evenly bright, a variance of at most `widest` (rad^2).

    Parts that meet within a larger bright set count separately if together they hold at least half of its excess.
    Otherwise the set is one part of uneven brightness."""
    values = luminance.reshape(-1)
    # An even disc of variance `widest` has 4 pi x `widest` steradians. Pixels so dark that they fill it with half of
    # `least` count as black.
    floor = least / (8 * np.pi * widest)
    order = np.argsort(-values, kind="stable")
    levels, areas, moments = values.tolist(), cells.solid_angles.tolist(), cells.moments.tolist()
    sets = _Sets(least, widest)
    for pixel in order[values[order] > floor].tolist():
        level, area = levels[pixel], areas[pixel]
        alone = _Set(area, level * area, level * level * area, moments[pixel], [pixel])
        sets.add(pixel, alone, level=level, neighbours=_neighbours(pixel, *luminance.shape))
    sets.close_all(floor)
    return sorted(sets.found, key=lambda part: -part.excess)


def _resolved(grown: _Set, level: float, least: float) -> list[Part]:
    """The parts of a set whose surroundings have this luminance: the set itself, the parts that met in it, or none."""
    excess = grown.light - level * grown.area
    if excess < least or sum(part.excess for part in grown.parts) >= excess / 2:
        return grown.parts
    # The part's mean luminance, weighted by its excess, must reach _CONTRAST times the level.
    if grown.light_squared - level * grown.light < _CONTRAST * level * excess:
        return grown.parts
    return [Part(np.array(grown.pixels), level, excess)]


def _neighbours(pixel: int, rows: int, cols: int) -> tuple[int, ...]:
    """The pixels beside, below and above. A panorama wraps around horizontally, and continues across the poles."""
    row, col = divmod(pixel, cols)
    across = (col + cols // 2) % cols
    below = (row - 1) * cols + col if row else across
    above = (row + 1) * cols + col if row < rows - 1 else row * cols + across
    return row * cols + (col + 1) % cols, row * cols + (col - 1) % cols, below, above
