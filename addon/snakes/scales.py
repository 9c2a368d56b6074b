# SPDX-License-Identifier: GPL-3.0-or-later
"""The net of a snake's skin (scales as cells of a diamond lattice, belly plates, and the ends of head and tail), and
where its vertices lie: plates that nearly follow the body.

A scale's number along its row is half of p + q, and its row is p - q. So each scale is a unit square of (p, q), and the
diagonal rows of a snake are the rows and columns of a square grid. Each square is cut into n x n quads, finer near its
edges, so that every edge of a scale is an edge of the mesh.

Vertices of the net have integer coordinates: A = P + Q along the body and X = P - Q around it. P and Q count samples, n
per scale. X is 0 on the back's midline. The rows end in a zigzag between |X| = (rows - 1) / 2 n and one row further.
Belly plates continue with X from there to the zigzag of the other side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .body import SIDE_ANGLE, Species, around

# Widths of a groove's side and of a pale rim, in sides of a scale.
GROOVE_WIDTH, RIM_WIDTH = 0.03, 0.13


class Cut(NamedTuple):
    """The resolution of the net: scales in a row; samples n of a scale's side; samples of a belly plate's width; rings
    of the head and of the tail's end."""

    scales: int
    n: int
    belly: int
    head: int
    tail: int


class Net(NamedTuple):
    """Faces over numbered vertices.

    cut           resolution
    a, x          (v,) integer coordinates of each vertex of the lattice and the belly
    quads         (f, 4) vertices, counter-clockwise from outside
    scale         (f,) a number for each scale and belly plate
    belly         (f,) whether a face belongs to a belly plate
    front, rear   (r,) vertices around the first and the last scales, in the direction of X"""

    cut: Cut
    a: np.ndarray
    x: np.ndarray
    quads: np.ndarray
    scale: np.ndarray
    belly: np.ndarray
    front: np.ndarray
    rear: np.ndarray


def cut_for(faces: int, rows: int, natural: float) -> Cut:
    """The cut with about `faces` faces whose scales per row are nearest to `natural`. Raises ValueError for too few."""
    best: tuple[float, Cut] | None = None
    for n in range(2, 64):
        belly, head = 2 * n + 2, max(8, 10 * n)
        around = (rows + 1) * n + belly
        column = rows * n * n + 2 * n * belly
        scales = round((faces - (head + n) * around - (rows + 1) // 2 * n * n) / column)
        if scales < 8:
            break
        off = abs(np.log(scales / natural))
        if best is None or off < best[0]:
            best = off, Cut(scales, n, belly, head, n)
    if best is None:
        raise ValueError(f"{faces} faces are too few for scales")
    return best[1]


def samples(n: int) -> np.ndarray:
    """Positions of the n samples of a scale's side from 0; the next scale begins at 1. The first is in the groove. The
    second and the last are the outer edge of the rim, and the ones next to them its inner edge."""
    if n == 2:
        return np.array((0.0, 0.5))
    edge = [0.0, GROOVE_WIDTH] if n < 6 else [0.0, GROOVE_WIDTH, RIM_WIDTH]
    inner = np.linspace(edge[-1], 1 - edge[-1], n - 2 * len(edge) + 3)
    return np.concatenate([edge[:-1], inner, 1 - np.array(edge[1:-1][::-1])])


def make_net(rows: int, cut: Cut) -> Net:
    """The net of `rows` rows of scales (3 more than a multiple of 4) with their belly plates."""
    n, half = cut.n, (rows - 1) // 2
    corners, scales = [], []
    for row in range(-half, half + 1):
        # The outermost rows, and every other row from there, begin half a scale earlier and have one more scale.
        early = (row - half) % 2 == 0
        centre = 2 * n * np.arange(cut.scales + early) + (0 if early else n)
        first = np.stack([centre - n, np.full(len(centre), n * row)], axis=1)
        corners.append(first)
        scales.append((row + half) * (cut.scales + 1) + np.arange(len(centre)))
    first, scale = np.concatenate(corners), np.concatenate(scales)
    i, j = (k.ravel() for k in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    di, dj = np.array((0, 0, 1, 1)), np.array((0, 1, 1, 0))
    p, q = i[:, None] + di, j[:, None] + dj
    a = first[:, 0, None, None] + p + q
    x = first[:, 1, None, None] + p - q
    belly_a, belly_x = _belly_faces(rows, cut)
    a, x = (np.concatenate([one.reshape(-1, 4), other]) for one, other in ((a, belly_a), (x, belly_x)))

    size = (rows + 1) * n + cut.belly
    keys, quads = np.unique((a + n) * size + (x + (half + 1) * n), return_inverse=True)
    plate = rows * (cut.scales + 1) + belly_a.min(axis=1) // (2 * n)
    around = np.arange(-(half + 1) * n, (half + 1) * n + cut.belly)
    depth = np.where(around < (half + 1) * n, n - np.abs((around + (half + 1) * n) % (2 * n) - n), 0)
    depth = np.where(around <= (half + 1) * n, depth, 0)
    ends = [(end + n) * size + (around + (half + 1) * n) for end in (-depth, 2 * n * cut.scales + depth)]
    front, rear = (np.searchsorted(keys, end) for end in ends)
    return Net(
        cut, keys // size - n, keys % size - (half + 1) * n, quads.reshape(-1, 4),
        np.concatenate([np.repeat(scale, n * n), plate]),
        np.arange(len(a)) >= len(scale) * n * n, front, rear,
    )  # fmt: skip


def _belly_faces(rows: int, cut: Cut) -> tuple[np.ndarray, np.ndarray]:
    """A and X (f, 4) of the corners of the belly plates' faces, from one zigzag to the other."""
    n, half = cut.n, (rows - 1) // 2
    a, j = (k.ravel() for k in np.meshgrid(np.arange(2 * n * cut.scales), np.arange(cut.belly), indexing="ij"))
    a, j = a[:, None] + (0, 1, 1, 0), j[:, None] + (0, 0, 1, 1)
    edge = zigzag(a, rows, n)
    x = np.where(j == 0, edge, np.where(j == cut.belly, -edge, (half + 1) * n + j))
    return a, x


def zigzag(a: np.ndarray, rows: int, n: int) -> np.ndarray:
    """The X of the zigzag edge of the scale rows, at each A."""
    return (rows - 1) // 2 * n + np.abs(a % (2 * n) - n)


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


def place(net: Net, species: Species, *, flatness: float, scatter: np.ndarray, rng: np.random.Generator) -> Places:
    """The places of a net's vertices. A `flatness` of 1 takes the body's roundness from each scale of back and sides,
    so that only its neighbours face another way. Each scale is tilted at random; `scatter` (scales + 3,) multiplies
    the species' tilts, along a row from the scale before its first one."""
    cut, half = net.cut, (species.rows - 1) // 2
    steepest = np.tan(np.radians(species.turn_deg * scatter))
    turns = steepest[:, None] * rng.uniform(-1, 1, (species.rows + 2, cut.scales + 3, 2))
    plates = steepest[1:-1] * rng.uniform(-1, 1, cut.scales + 1)
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
