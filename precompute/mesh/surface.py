# SPDX-License-Identifier: GPL-3.0-or-later
"""A triangle mesh as a surface: which corners meet, and a tangent plane at each node.

Corner 3 t + k is the k-th corner of triangle t; it also stands for the edge from there to the next corner. A *node* is
a fan of triangles around a point, connected by shared edges. Most points have one node. A point where two sheets touch
has two. Sheets are also cut apart at an edge of three triangles, or of two with opposite winding. A node's tangent
plane has polar coordinates in which the angles of its corners make a full turn (Knöppel, Crane, Pinkall and Schröder,
"Globally optimal direction fields", 2013, section 3), so a direction is a complex number.

Meshes come from untrusted .npz files (format: NumPy's reference, "numpy.lib.format"). NumPy's own reader would trust
the header and raise undocumented errors."""

import math
import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from ..base.files import is_no_file
from ..base.machine import refuse_beyond_memory
from ..base.strict import Archive

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


def nearest(points: np.ndarray, places: np.ndarray) -> np.ndarray:
    """For each place (p, 3) the index (p,) of the nearest of the points (n, 3), n >= 1."""
    low, high = points.min(axis=0), points.max(axis=0)
    extent = float((high - low).max()) or 1.0
    found = np.full(len(places), -1)
    left = np.arange(len(places))
    # A cell holds about one point of a surface. A place without a point that near is searched in cells twice as large.
    size = extent / max(1.0, np.sqrt(len(points)))
    while len(left):
        index, distance = _in_grid(points - low, places[left] - low, size)
        sure = distance <= size
        found[left[sure]] = index[sure]
        left = left[~sure]
        size *= 2
    return found


def _in_grid(points: np.ndarray, places: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """The nearest point in each place's cell and its neighbours, and the distance; infinite without a point."""
    cells = np.floor(points / size).astype(np.int64)
    at = np.floor(np.clip(places / size, -2, cells.max(axis=0) + 3)).astype(np.int64)
    width = cells.max(axis=0) + 7
    key = _key(cells, width)
    order = np.argsort(key, kind="stable")
    key = key[order]
    best, least = np.full(len(places), -1), np.full(len(places), np.inf)
    for offset in np.ndindex(3, 3, 3):
        around = _key(at + np.array(offset) - 1, width)
        begin, end = np.searchsorted(key, around), np.searchsorted(key, around, side="right")
        count = end - begin
        place = np.repeat(np.arange(len(places)), count)
        number = np.arange(len(place)) - np.repeat(np.cumsum(count) - count, count)
        point = order[begin[place] + number]
        distance = np.linalg.norm(points[point] - places[place], axis=1)
        # The nearest is written last.
        by_distance = np.argsort(-distance, kind="stable")
        place, point, distance = place[by_distance], point[by_distance], distance[by_distance]
        nearer = distance < least[place]
        best[place[nearer]], least[place[nearer]] = point[nearer], distance[nearer]
    return best, least


def _key(cells: np.ndarray, width: np.ndarray) -> np.ndarray:
    """One number for each cell (n, 3), whose indices run from -3 to width - 4."""
    x, y, z = (cells + 3).T
    return (x * width[1] + y) * width[2] + z


# The greatest distance of a point from the origin, in metres: xatlas squares areas in single precision.
FARTHEST_M = 1e6
# The greatest total size of a file's arrays, in bytes: about 40 million triangles.
_LARGEST = 1 << 31
# NumPy's letters for the allowed kinds of number ("f", "i", "u", "U"), and the shape, where None is any length.
Wanted = tuple[str, tuple[int | None, ...]]
# The magic bytes of an .npy file, and the format of the header's length for each major version.
_BEGINNING = b"\x93NUMPY"
_LENGTHS = {1: "<H", 2: "<I", 3: "<I"}
_HEADER_MAX = 1 << 14
_HEADER = re.compile(
    r"\{'descr': '([<>|=]?[iufU]\d{1,3})', 'fortran_order': (True|False), 'shape': \(((?:\d{1,10},? ?)*)\), \}\s*"
)


def read_arrays(path: Path, wanted: Mapping[str, Wanted]) -> dict[str, np.ndarray]:
    """Read the wanted arrays that a file holds; other arrays are ignored. The arrays are read-only.

    Raises OSError if the file cannot be read; ValueError, with the fault, if it is no .npz file or an array has another
    kind or shape; GratingError if the arrays do not fit into memory."""
    if is_no_file(path):
        raise ValueError("it is not a file")
    with path.open("rb") as file:
        archive = Archive(file)
        names = {name: f"{name}.npy" for name in wanted if f"{name}.npy" in archive.names}
        total = sum(archive.size(member) for member in names.values())
        if total > _LARGEST:
            raise ValueError(f"more than {_LARGEST >> 30} GiB of arrays")
        refuse_beyond_memory(2 * total, "reading its arrays", "give a smaller mesh", source=path)
        return {name: _array(name, archive.read(member, _LARGEST), wanted[name]) for name, member in names.items()}


def _array(name: str, data: bytes, wanted: Wanted) -> np.ndarray:
    """Decode the array in the bytes of an .npy file."""
    form = _LENGTHS.get(data[6]) if data.startswith(_BEGINNING) and len(data) >= 12 else None
    if form is None:
        raise ValueError(f"{name} is not an array")
    first = 8 + struct.calcsize(form)
    (length,) = struct.unpack_from(form, data, 8)
    header = _HEADER.fullmatch(data[first : first + min(length, _HEADER_MAX)].decode("latin-1"))
    if header is None:
        raise ValueError(f"{name} is not an array of numbers")
    kinds, shape = wanted
    kind, sizes = np.dtype(header[1]), tuple(int(size) for size in re.findall(r"\d+", header[3]))
    fits = len(sizes) == len(shape) and all(want in (None, size) for size, want in zip(sizes, shape, strict=True))
    if kind.kind not in kinds or not fits:
        raise ValueError(f"{name} is of kind {kind} and shape {str(sizes):.60}")
    if math.prod(sizes) * kind.itemsize != len(data) - first - length:
        raise ValueError(f"{name} is not as long as its header says")
    array = np.frombuffer(data, kind, offset=first + length).reshape(sizes, order="F" if header[2] == "True" else "C")
    if kind.kind == "U":
        array.tolist()  # raises ValueError at an invalid character
    return array
