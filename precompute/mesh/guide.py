# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides of a comb, as a pull on each node of a surface: a direction in its tangent plane times a weight.

A direction that is known everywhere is smoothed over two edges, so the field follows it except where it contradicts
itself. A stroke pulls the nodes nearest to it; between strokes the field is as smooth as possible. The direction along
a body is found by the heat method (Crane, Weischedel and Wardetzky, "Geodesics in heat", 2013)."""

import numpy as np

from ..base.progress import Progress, silent, span_of
from .direction_field import Hierarchy, Matrix, hierarchy_of, laplacian, solve
from .surface import Surface, complex_sums, nearest, unit

# The smoothing length, in edges, of a direction that is known everywhere.
_SMOOTHED = 2.0
# The weight of a stroke at a node; an edge has weight 1.
_STROKE = 10.0


def along_axis(surface: Surface, axis: np.ndarray) -> np.ndarray:
    """Pull (nodes,) along one direction (3,) everywhere; 0 where the surface is perpendicular to it."""
    return along_triangles(surface, np.broadcast_to(unit(np.reshape(axis, (1, 3))), (len(surface.triangles), 3)))


def along_triangles(surface: Surface, vectors: np.ndarray) -> np.ndarray:
    """Pull (nodes,) along a vector (m, 3) of at most length 1 on each triangle."""
    shares = np.repeat(surface.areas / 3, 3) / (_SMOOTHED * surface.length) ** 2
    laid = surface.to_complex(np.repeat(vectors, 3, axis=0)) * shares
    return complex_sums(surface.node, laid, surface.node_count)


def along_uv(surface: Surface, uv: np.ndarray) -> np.ndarray:
    """Pull (nodes,) along U, from the UV (m, 3, 2) of the triangles' corners. A triangle without area in the UV map
    pulls nothing. The two sides of a seam where U reverses pull against each other."""
    one, two = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    turned = np.sign(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    sides = surface.sides.reshape(-1, 3, 3)
    along = (sides[:, 0] * two[:, 1:] + sides[:, 2] * one[:, 1:]) * turned[:, None]
    return along_triangles(surface, unit(along) * (np.linalg.norm(along, axis=1, keepdims=True) > 0))


def along_bones(surface: Surface, segments: np.ndarray) -> np.ndarray:
    """Pull (nodes,) along bones, segments (k, 2, 3) from head to tail, weighted by the distance to the power -4."""
    points = surface.points[surface.point_of_node]
    directions = np.zeros_like(points)
    for head, tail in segments:
        bone = tail - head
        along = np.clip((points - head) @ bone / max(bone @ bone, np.finfo(float).tiny), 0, 1)
        square = ((points - head - along[:, None] * bone) ** 2).sum(axis=1)
        directions += unit(bone[None]) / np.maximum(square, 1e-6 * surface.length**2)[:, None] ** 2
    return surface.to_plane(unit(directions)) * surface.mass / (_SMOOTHED * surface.length) ** 2


def along_strokes(surface: Surface, segments: np.ndarray) -> np.ndarray:
    """Pull (nodes,) along strokes on the surface, segments (k, 2, 3) in drawing order. Each stroke pulls the nodes
    nearest to it. A loose part without a stroke takes the direction of the stroke nearest to its centre."""
    places, directions = _pieces(segments, surface.length / 2)
    points = surface.points[surface.point_of_node]
    node = nearest(points, places)
    vectors = np.stack([np.bincount(node, directions[:, k], surface.node_count) for k in range(3)], axis=1)
    pull = surface.to_plane(vectors)
    size = np.abs(pull)
    pull = np.where(size > 1e-9, pull / np.maximum(size, 1e-9) * _STROKE, 0)
    bare = _bare_parts(surface, pull)
    if not len(bare):
        return pull
    return pull + _like_nearest(surface, bare, places, directions=directions)


def where_bare(surface: Surface, pull: np.ndarray) -> np.ndarray:
    """Add a pull to loose parts that have none: along the longest of their x, y and z axes."""
    bare = _bare_parts(surface, pull)
    if not len(bare):
        return pull
    points, part = surface.points[surface.point_of_node], surface.parts
    low, high = np.full((part.max() + 1, 3), np.inf), np.full((part.max() + 1, 3), -np.inf)
    np.minimum.at(low, part, points)
    np.maximum.at(high, part, points)
    axes = np.eye(3)[(high - low).argmax(axis=1)]
    here = np.isin(part, bare)
    return np.where(here, _pull_of(surface, axes[part]), pull)


def like_part(surface: Surface, pull: np.ndarray, part: int) -> np.ndarray:
    """Add a pull to loose parts that have none: that of the nearest node of the given part."""
    bare = _bare_parts(surface, pull)
    bare = bare[bare != part]
    if not len(bare):
        return pull
    of_part = np.flatnonzero((surface.parts == part) & (pull != 0))
    if not len(of_part):
        return pull
    places = surface.points[surface.point_of_node[of_part]]
    return pull + _like_nearest(surface, bare, places, directions=unit(surface.to_space(pull)[of_part]))


def _like_nearest(surface: Surface, parts: np.ndarray, places: np.ndarray, *, directions: np.ndarray) -> np.ndarray:
    """Pull each of some parts in one direction: the direction at the place nearest to the part's centre."""
    points, part = surface.points[surface.point_of_node], surface.parts
    count = np.bincount(part)
    middle = np.stack([np.bincount(part, points[:, k]) for k in range(3)], axis=1) / count[:, None]
    of_part = np.zeros((len(count), 3))
    of_part[parts] = directions[nearest(places, middle[parts])]
    return _pull_of(surface, of_part[part])


def _pull_of(surface: Surface, vectors: np.ndarray) -> np.ndarray:
    """The pull of a vector (nodes, 3) at each node."""
    return surface.to_plane(vectors) * surface.mass / (_SMOOTHED * surface.length) ** 2


def _bare_parts(surface: Surface, pull: np.ndarray) -> np.ndarray:
    """The loose parts that have almost no pull."""
    part = surface.parts
    pulled = np.bincount(part, np.abs(pull))
    most = np.bincount(part, surface.mass) / (_SMOOTHED * surface.length) ** 2
    return np.flatnonzero(pulled < 1e-6 * most)


def _pieces(segments: np.ndarray, longest: float) -> tuple[np.ndarray, np.ndarray]:
    """Cut segments into pieces no longer than `longest`. Returns their midpoints (p, 3) and their vectors (p, 3)."""
    along = segments[:, 1] - segments[:, 0]
    count = np.ceil(np.linalg.norm(along, axis=1) / longest).astype(int)
    of = np.repeat(np.arange(len(segments)), count)
    number = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
    vectors = along[of] / count[of, None]
    return segments[of, 0] + (number + 0.5)[:, None] * vectors, vectors


# The ends are searched for on a level of at most about this many nodes.
_COARSE = 3000
# The heat's decay length over the body's length. The decay over the body, e^-8, is far above the solver's error.
_REACH = 1 / 8
_TOLERANCE = 1e-9
# Share of the diagonal that is added to the Laplacian, which is singular.
_SHARE = 1e-6
# The head is the end with more surface within this share of the length.
_HEAD = 0.15


def head_to_tail(surface: Surface, *, progress: Progress = silent) -> np.ndarray:
    """The pull (nodes,) from head to tail along the largest loose part. The head is the thicker end. Other parts, such
    as eyes, take the pull of the largest part nearest to them."""
    bare = laplacian(surface, transported=False)
    # One hierarchy serves both steps: a preconditioner need not match the matrix exactly.
    hierarchy = hierarchy_of(Matrix(bare.diagonal * (1 + _SHARE), bare.row, bare.column, bare.value))
    progress("combing", 0.3)
    part = surface.parts
    largest = int(np.bincount(part, surface.mass).argmax())
    head, length = _head(surface, hierarchy, part == largest)
    if length == 0:
        return np.zeros(surface.node_count, complex)
    kept = surface.mass / (_REACH * length) ** 2
    matrix = Matrix(bare.diagonal + kept, bare.row, bare.column, bare.value)
    source = np.zeros(surface.node_count)
    source[head] = 1
    heat, _ = solve(matrix, source, hierarchy, tolerance=_TOLERANCE, progress=span_of(progress, 0.3, 1))
    heat = np.where(part == largest, heat, 0)
    return like_part(surface, along_triangles(surface, _downhill(surface, heat)), largest)


def _downhill(surface: Surface, heat: np.ndarray) -> np.ndarray:
    """The directions (m, 3) in which a scalar at the nodes decreases on each triangle; 0 where it is constant."""
    at = heat[surface.node].reshape(-1, 3)
    sides = surface.sides.reshape(-1, 3, 3)
    # The gradient is the sum of each corner's value times the opposite edge, turned about the normal.
    turned = np.cross(surface.normals[:, None], np.roll(sides, -1, axis=1))
    gradient = np.einsum("ij,ijk->ik", at, turned)
    steep = np.linalg.norm(gradient, axis=1, keepdims=True) > 0
    return -unit(gradient) * steep


def _head(surface: Surface, hierarchy: Hierarchy, largest: np.ndarray) -> tuple[int, float]:
    """Find the head's node and the length of the largest part, by shortest paths along a coarse level's edges."""
    nodes, mass = np.arange(surface.node_count), surface.mass
    while len(nodes) > _COARSE and hierarchy.coarse is not None and largest[nodes].sum() > _COARSE // 10:
        mass = np.bincount(hierarchy.joined, mass * hierarchy.carry, len(hierarchy.seeds))
        nodes, hierarchy = nodes[hierarchy.seeds], hierarchy.coarse
    points = surface.points[surface.point_of_node[nodes]]
    matrix = hierarchy.matrix
    lengths = np.linalg.norm(points[matrix.row] - points[matrix.column], axis=1)
    inside = np.flatnonzero(largest[nodes])

    def ways(begin: int) -> np.ndarray:
        way = _ways(matrix, lengths, begin)
        return np.where(largest[nodes] & np.isfinite(way), way, 0)

    one = int(ways(int(inside[0])).argmax())
    from_one = ways(one)
    other = int(from_one.argmax())
    length = float(from_one[other])
    skin = [mass[inside][ways(end)[inside] <= _HEAD * length].sum() for end in (one, other)]
    return int(nodes[one if skin[0] >= skin[1] else other]), length


def _ways(matrix: Matrix, lengths: np.ndarray, begin: int) -> np.ndarray:
    """The shortest path lengths (n,) from one node along the entries' lengths; infinite if unreachable."""
    way = np.full(len(matrix.diagonal), np.inf)
    way[begin] = 0
    filled = np.unique(matrix.row)
    while len(filled):
        through = np.minimum.reduceat(way[matrix.column] + lengths, matrix.starts)
        shorter = np.minimum(way[filled], through)
        if (shorter == way[filled]).all():
            break
        way[filled] = shorter
    return way
