# SPDX-License-Identifier: GPL-3.0-or-later
"""The positions and heights of the net's vertices on the skin: plates that nearly follow the body."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .body import SIDE_ANGLE, around
from .lattice import GROOVE_WIDTH, RIM_WIDTH, Cut, Net, samples, zigzag
from .species import Species

# How far the middle of an edge between two scales is shifted tailwards. It rounds the tail end of a scale, which hides
# the pointed head of the next. In scale lengths, as are the next constants.
_BULGE = 0.10
# The overhang of a scale's tail edge over the next scale, and the depth of the grooves.
_OVERHANG, _GROOVE = 0.02, 0.03
# Where the pale rim of a scale begins, from its middle (0) to its edge (1).
_PLATE = 1 - 2 * RIM_WIDTH
# The inner part of a scale that is flat, and the half width of a keel; in rows.
_INNER = 0.6
_KEEL_WIDTH = 0.08


class Places(NamedTuple):
    """Vertices of a net (v,): number of scales from the first one, angle around the body, rise and tailward overhang
    over the next scale in scale lengths, pale rim (0 to 1), and distance from its plate's groove in samples."""

    along: np.ndarray
    angle: np.ndarray
    rise: np.ndarray
    overhang: np.ndarray
    rim: np.ndarray
    inside: np.ndarray


def place(net: Net, species: Species, *, flatness: float, rng: np.random.Generator) -> Places:
    """The places of a net's vertices. Each scale is tilted a little at random. A `flatness` of 1 takes the body's
    roundness from each scale of back and sides, so that only its neighbours face another way."""
    cut, half = net.cut, (species.rows - 1) // 2
    turns = np.tan(np.radians(species.turn_deg)) * rng.uniform(-1, 1, (species.rows + 2, cut.scales + 3, 2))
    plates = np.tan(np.radians(species.turn_deg)) * rng.uniform(-1, 1, cut.scales + 1)
    on_belly = net.x > (half + 1) * cut.n
    scales = _on_scales(net.a[~on_belly], net.x[~on_belly], cut, species=species, flatness=flatness, turns=turns)
    belly = _on_belly(net.a[on_belly], net.x[on_belly], cut, species=species, turns=plates)
    found = []
    for one, other in zip(scales, belly, strict=True):
        both = np.empty(len(net.a), one.dtype)
        both[~on_belly], both[on_belly] = one, other
        found.append(both)
    return Places(*found)


class _Cells(NamedTuple):
    """Vertices of the lattice: number along its row, and row, of the scale that each is in or on whose head edge it is;
    samples (i, j) in it; fractions (p, q) of its sides; position along in scales, and around the body in rows."""

    column: np.ndarray
    row: np.ndarray
    i: np.ndarray
    j: np.ndarray
    p: np.ndarray
    q: np.ndarray
    along: np.ndarray
    across: np.ndarray

    @property
    def bulged(self) -> np.ndarray:
        """`along`, with the edges between scales curved tailwards."""
        return self.along + _BULGE * 4 * (self.p * (1 - self.p) + self.q * (1 - self.q))


def _cells(a: np.ndarray, x: np.ndarray, n: int) -> _Cells:
    (p0, i), (q0, j) = np.divmod((a + x) // 2, n), np.divmod((a - x) // 2, n)
    sides = samples(n)
    p, q = sides[i], sides[j]
    return _Cells((p0 + q0 + 1) // 2, p0 - q0, i, j, p, q, (p0 + p + q0 + q) / 2, p0 + p - q0 - q)


def _on_scales(
    a: np.ndarray, x: np.ndarray, cut: Cut, *, species: Species, flatness: float, turns: np.ndarray
) -> Places:
    n, half = cut.n, (species.rows - 1) // 2
    cells = _cells(a, x, n)
    angle = cells.across / (half + 1) * SIDE_ANGLE
    row_width, row_turn = _across(cells.row, SIDE_ANGLE / (half + 1))
    row_width = row_width / species.scale_length
    lengthwise, sideways = (cells.p + cells.q - 1) / 2, cells.p - cells.q
    turn = turns[np.clip(cells.row + half, 0, species.rows + 1), np.clip(cells.column + 1, 0, cut.scales + 2)]
    # The curved edges shift the scale's places tailwards, and a tilted plane rises there.
    tailwards = lengthwise + cells.bulged - cells.along - _BULGE
    rise = (species.lift + turn[:, 0]) * tailwards + turn[:, 1] * row_width * sideways
    rise += species.dome * (1 - 4 * lengthwise**2 - sideways**2)
    rise += flatness * row_width * row_turn / 2 * sideways**2
    back = np.clip(np.cos(angle), 0, 1)
    rise += species.keel * back * np.exp(-((sideways / _KEEL_WIDTH) ** 2)) * (1 - 4 * lengthwise**2)
    inside = np.minimum(np.minimum(cells.i, n - cells.i), np.minimum(cells.j, n - cells.j))
    rise -= _GROOVE * ((inside == 0) & (n > 2))
    tail_edge = (inside > 0) & ((cells.i == n - 1) | (cells.j == n - 1)) & (n > 3)
    # Plates are rounder than their cells, so the rim is wider at the corners.
    out = ((2 * cells.p - 1) ** 4 + (2 * cells.q - 1) ** 4) ** 0.25
    rim = np.where(inside == 0, 1.0, np.clip((out - _PLATE) / (1 - 2 * GROOVE_WIDTH - _PLATE), 0, 1))
    return Places(cells.bulged, angle, rise, _OVERHANG * tail_edge, rim, inside)


def _across(row: np.ndarray, row_angle: float) -> tuple[np.ndarray, np.ndarray]:
    """For scales of each row: half of a scale's width, in half widths of the body, and the turn of the body's normal
    over it. Both are measured under the scale's inner part, where most of its area is."""
    ends = around((row + _INNER / 2) * row_angle), around((row - _INNER / 2) * row_angle)
    return tuple((one - other) / _INNER for one, other in zip(*ends, strict=True))


def _on_belly(a: np.ndarray, x: np.ndarray, cut: Cut, *, species: Species, turns: np.ndarray) -> Places:
    n, half = cut.n, (species.rows - 1) // 2
    edge = _cells(a, zigzag(a, species.rows, n), n)
    k = x - (half + 1) * n
    widths = np.concatenate([[0.0], np.linspace(0.012, 0.988, cut.belly - 1)])
    w = widths[k]
    begin = edge.across / (half + 1) * SIDE_ANGLE
    angle = begin + w * 2 * (np.pi - begin)
    from_side = np.minimum(w, 1 - w)
    along = edge.along + (edge.bulged - edge.along) * np.clip(1 - from_side / 0.2, 0, 1)
    plate, i = np.divmod(a, 2 * n)
    lengthwise = edge.along - plate - 0.5
    rise = (species.lift + turns[np.clip(plate, 0, len(turns) - 1)]) * lengthwise
    rise += species.dome * (1 - 4 * lengthwise**2)
    inside = np.minimum(np.minimum(i, 2 * n - i), np.minimum(k, cut.belly - k))
    rise -= _GROOVE * ((inside == 0) & (n > 2))
    tail_edge = (inside > 0) & (i == 2 * n - 1) & (n > 3)
    rim = np.where(inside < min(2, n // 2), 1.0, 0.0)
    return Places(along, angle, rise, _OVERHANG * tail_edge, rim, inside)
