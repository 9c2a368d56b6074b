# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the direction along a body by the heat method (Crane, Weischedel and Wardetzky, "Geodesics in heat", 2013)."""

import numpy as np

from ..base.progress import Progress, silent, span_of
from .direction_field import laplacian
from .guide import along_triangles, like_part
from .multigrid import Hierarchy, Matrix, hierarchy_of, solve
from .surface import Surface, unit

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
