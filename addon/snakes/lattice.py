# SPDX-License-Identifier: GPL-3.0-or-later
"""The net of a snake's skin: scales as cells of a diamond lattice, belly plates, and the ends of head and tail.

A scale's number along its row is half of p + q, and its row is p - q. So each scale is a unit square of (p, q), and the
diagonal rows of a snake are the rows and columns of a square grid. Each square is cut into n x n quads, finer near its
edges, so that every edge of a scale is an edge of the mesh.

Vertices of the net have integer coordinates: A = P + Q along the body and X = P - Q around it. P and Q count samples, n
per scale. X is 0 on the back's midline. The rows end in a zigzag between |X| = (rows - 1) / 2 n and one row further.
Belly plates continue with X from there to the zigzag of the other side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

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
