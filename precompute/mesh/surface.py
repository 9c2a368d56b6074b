# SPDX-License-Identifier: GPL-3.0-or-later
"""A triangle mesh as a surface: which corners meet, and a tangent plane at each node.

Corner 3 t + k is the k-th corner of triangle t; it also stands for the edge from there to the next corner. A *node* is
a fan of triangles around a point, connected by shared edges. Most points have one node. A point where two sheets touch
has two. Sheets are also cut apart at an edge of three triangles, or of two with opposite winding. A node's tangent
plane has polar coordinates in which the angles of its corners make a full turn (Knöppel, Crane, Pinkall and Schröder,
"Globally optimal direction fields", 2013, section 3), so a direction is a complex number.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

# A triangle whose height is below this share of its longest side counts as having no area.
_FLAT = 1e-7


@dataclass(frozen=True)
class Surface:
    """points     (n, 3) in metres
    triangles  (m, 3) their points, wound anticlockwise as seen from outside; triangles without area are left out
    kept       (m,) their indices among the triangles given
    twin       (3 m,) for each corner's edge, the corner of the same edge in the triangle across it; -1 at a rim
    node       (3 m,) the node of each corner
    polar      (3 m,) the polar angle of each corner's edge at its node
    turn       (3 m,) the angle of each corner in these coordinates
    is_open    (nodes,) whether the node is at the surface's rim"""

    points: np.ndarray
    triangles: np.ndarray
    kept: np.ndarray
    twin: np.ndarray
    node: np.ndarray
    polar: np.ndarray
    turn: np.ndarray
    is_open: np.ndarray

    @property
    def node_count(self) -> int:
        """The number of nodes."""
        return len(self.is_open)

    @cached_property
    def sides(self) -> np.ndarray:
        """The vectors (3 m, 3) along the edges of the corners."""
        corners = self.points[self.triangles]
        return (np.roll(corners, -1, axis=1) - corners).reshape(-1, 3)

    @cached_property
    def normals(self) -> np.ndarray:
        """The normals (m, 3) of the triangles; their length is twice the area."""
        return np.cross(self.sides[0::3], -self.sides[2::3])

    @cached_property
    def areas(self) -> np.ndarray:
        """The areas (m,) of the triangles, in square metres."""
        return np.linalg.norm(self.normals, axis=1) / 2

    @cached_property
    def mass(self) -> np.ndarray:
        """The area (nodes,) of each node: a third of the area of its triangles."""
        return np.bincount(self.node, np.repeat(self.areas / 3, 3), self.node_count)

    @cached_property
    def length(self) -> float:
        """The mean length of an edge, in metres."""
        return float(np.linalg.norm(self.sides, axis=1).mean())

    @cached_property
    def point_of_node(self) -> np.ndarray:
        """The point (nodes,) of each node."""
        points = np.empty(self.node_count, np.int64)
        points[self.node] = self.triangles.ravel()
        return points

    @cached_property
    def frames(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Unit vectors x, y, n (nodes, 3) of each node. n is the area-weighted mean normal of its triangles; x is
        rotated so that the edges, projected into the plane, best match their polar angles."""
        n = unit(self.gathered(np.repeat(self.normals, 3, axis=0)))
        sideways = np.eye(3)[np.abs(n).argmin(axis=1)]
        x = unit(np.cross(n, sideways))
        y = np.cross(n, x)
        laid = self._in_plane(self.sides, x, y)
        laid /= np.maximum(np.abs(laid), np.finfo(float).tiny)
        laid *= np.exp(-1j * self.polar)
        offset = complex_sums(self.node, laid, self.node_count)
        offset = np.where(np.abs(offset) > 1e-9, offset, 1)
        offset /= np.abs(offset)
        return n_turned(x, y, offset), n_turned(y, -x, offset), n

    def gathered(self, vectors: np.ndarray) -> np.ndarray:
        """Sum vectors (3 m, 3) at the corners over each node: (nodes, 3)."""
        return np.stack([np.bincount(self.node, vectors[:, axis], self.node_count) for axis in range(3)], axis=1)

    def to_complex(self, vectors: np.ndarray) -> np.ndarray:
        """Project vectors (3 m, 3) at the corners into the tangent planes of their nodes: (3 m,) complex."""
        return self._in_plane(vectors, *self.frames[:2])

    def to_plane(self, vector: np.ndarray) -> np.ndarray:
        """Project a vector (3,), or one per node (nodes, 3), into the nodes' tangent planes: (nodes,) complex."""
        x, y, _ = self.frames
        return (x * vector).sum(axis=1) + 1j * (y * vector).sum(axis=1)

    def to_space(self, field: np.ndarray) -> np.ndarray:
        """The vectors (nodes, 3) of a field (nodes,) in the tangent planes."""
        x, y, _ = self.frames
        return n_turned(x, y, field)

    def _in_plane(self, vectors: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        along = np.einsum("ij,ij->i", vectors, x[self.node])
        return along + 1j * np.einsum("ij,ij->i", vectors, y[self.node])

    @cached_property
    def transport(self) -> np.ndarray:
        """The rotation (3 m,) that carries a direction along each corner's edge, from its node to the next corner's."""
        after = following(np.arange(len(self.node)))
        back = self.polar[after] + self.turn[after]
        return np.exp(1j * (back + np.pi - self.polar))

    @cached_property
    def curvature(self) -> np.ndarray:
        """The curvature (m,) of each triangle: the angle by which a direction turns when it is carried around the
        triangle. On a closed surface the sum is 2 pi times the Euler characteristic."""
        return self.turn.reshape(-1, 3).sum(axis=1) - np.pi

    @cached_property
    def parts(self) -> np.ndarray:
        """The number (nodes,) of each node's loose part."""
        label = np.arange(self.node_count)
        ends = np.stack([self.node, self.node[following(np.arange(len(self.node)))]])
        while True:
            low = np.minimum(label[ends[0]], label[ends[1]])
            before = label.copy()
            for end in ends:
                np.minimum.at(label, before[end], low)
            while (label[label] != label).any():
                label = label[label]
            if (label == before).all():
                return np.unique(label, return_inverse=True)[1]


def surface_of(points: np.ndarray, triangles: np.ndarray) -> Surface:
    """Build the surface of points (n, 3), in metres, and triangles (m, 3). Triangles without area are dropped."""
    points, triangles = np.asarray(points, float), np.asarray(triangles, np.int64)
    sides = np.linalg.norm(points[triangles] - points[np.roll(triangles, -1, axis=1)], axis=2)
    corners = points[triangles]
    doubled = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    kept = np.flatnonzero(doubled > _FLAT * sides.max(axis=1, initial=0) ** 2)
    triangles, sides = triangles[kept], sides[kept]
    # Angles from the side lengths, by the law of cosines.
    opposite, left, right = np.roll(sides, -1, axis=1), sides, np.roll(sides, 1, axis=1)
    cosine = (left**2 + right**2 - opposite**2) / (2 * left * right)
    angles = np.arccos(np.clip(cosine, -1, 1)).ravel()
    twins = _twins(triangles)
    onwards = twins[preceding(np.arange(len(twins)))]
    starts, is_open = _starts(twins, onwards)
    node, polar, total = _walk(starts, onwards, angles)
    scale = np.where(is_open, 1, 2 * np.pi / total)[node]
    return Surface(points, triangles, kept, twins, node, polar * scale, angles * scale, is_open)


def following(corners: np.ndarray) -> np.ndarray:
    """The next corner of the same triangle."""
    return corners + 1 - 3 * (corners % 3 == 2)


def preceding(corners: np.ndarray) -> np.ndarray:
    """The previous corner of the same triangle."""
    return corners - 1 + 3 * (corners % 3 == 0)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Scale vectors (n, 3) to length 1; a zero vector becomes Z."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length > 0, vectors / np.where(length > 0, length, 1), [0.0, 0.0, 1.0])


def n_turned(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """The vectors x Re z + y Im z (n, 3)."""
    return x * z.real[:, None] + y * z.imag[:, None]


def complex_sums(index: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """Sum complex values by their index: (count,)."""
    return np.bincount(index, values.real, count) + 1j * np.bincount(index, values.imag, count)


def _twins(triangles: np.ndarray) -> np.ndarray:
    """For each corner's edge, the one other corner with the same edge reversed; -1 if none or several."""
    begin, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    key = low * (triangles.max(initial=0) + 1) + high
    order = np.argsort(key, kind="stable")
    new = np.flatnonzero(np.diff(key[order], prepend=-1))
    pairs = new[np.diff(new, append=len(key)) == 2]
    one, other = order[pairs], order[pairs + 1]
    opposite = begin[one] != begin[other]
    twins = np.full(len(key), -1)
    twins[one[opposite]], twins[other[opposite]] = other[opposite], one[opposite]
    return twins


def _starts(twins: np.ndarray, onwards: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The corner at which each fan starts, and whether the fan is open. An open fan starts at the rim."""
    first = np.flatnonzero(twins < 0)
    last = first.copy()
    while (onwards[last] >= 0).any():
        last = np.where(onwards[last] >= 0, onwards[last], last)
    jump = onwards.copy()
    jump[last] = first
    # The fans are cycles now. Each corner takes the least number in its fan, in jumps of doubling length.
    lowest = np.arange(len(twins))
    while True:
        lower = np.minimum(lowest, lowest[jump])
        if (lower == lowest).all():
            break
        lowest, jump = lower, jump[jump]
    cut = np.zeros(len(twins), bool)
    cut[lowest[first]] = True
    closed = np.flatnonzero((lowest == np.arange(len(twins))) & ~cut)
    return np.concatenate([first, closed]), np.arange(len(first) + len(closed)) < len(first)


def _walk(starts: np.ndarray, onwards: np.ndarray, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Walk all fans at once. Returns for each corner its fan and the angle before it, and for each fan the total
    angle."""
    node, polar = np.full(len(angles), -1), np.zeros(len(angles))
    total = np.zeros(len(starts))
    fan, corner = np.arange(len(starts)), starts
    while len(fan):
        node[corner], polar[corner] = fan, total[fan]
        total[fan] += angles[corner]
        corner = onwards[corner]
        on = (corner >= 0) & (corner != starts[fan])
        fan, corner = fan[on], corner[on]
    return node, polar, total
