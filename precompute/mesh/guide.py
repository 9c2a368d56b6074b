# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides of a comb, as a pull on each node of a surface: a direction in its tangent plane times a weight.

A direction that is known everywhere is smoothed over two edges, so the field follows it except where it contradicts
itself. A stroke pulls the nodes nearest to it; between strokes the field is as smooth as possible.
"""

import numpy as np

from .nearest import nearest
from .surface import Surface, complex_sums, unit

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
