# SPDX-License-Identifier: GPL-3.0-or-later
"""The smoothest field of unit directions on a surface that follows a guide.

The field z minimises |grad z|^2 + sum of w |z - g|^2 over the nodes: the connection Laplacian of Knöppel et al. 2013,
and the guide's directions g with weights w. Without a guide, z is the eigenvector of the Laplacian's smallest
eigenvalue. Finally each z is scaled to length 1.
"""

from dataclasses import dataclass

import numpy as np

from ..base.progress import Progress, silent, span_of
from .multigrid import Hierarchy, Matrix, hierarchy_of, matrix_of, solve
from .singular import singular_triangles
from .surface import Surface, complex_sums, following

# Bounds of an edge's weight (cot + cot) / 2, which is negative or infinite at slivers.
_LEAST, _MOST = 1e-2, 1e2
# A field without a guide is smoothed over a length of the square root of a third of the surface's area: in several
# steps on levels of at most _COARSE nodes, where steps are cheap, and in one step on larger levels.
_COARSE = 20000
_EVEN, _EVEN_STEPS, _EVEN_TOLERANCE = 3.0, 4, 1e-3
# Tolerances with a guide. If the guide reaches few nodes, the solution is weak far from it and needs the smaller one.
_TOLERANCE, _SPARSE_TOLERANCE = 1e-6, 1e-9
# The band around a flip, in edges, on which the guide is dropped; how often new flips are searched for.
_BAND, _ATTEMPTS = 4, 3


@dataclass(frozen=True)
class Field:
    """direction (nodes,) unit complex: the direction in each node's tangent plane
    residual  relative residual of the linear system"""

    direction: np.ndarray
    residual: float


def laplacian(surface: Surface, *, transported: bool = True) -> Matrix:
    """Build the Laplacian of the surface for directions or, if not transported, for scalars. It is Hermitian and
    positive: z* L z sums weight times |z_j - r z_i|^2 over the edges."""
    weight = np.append(_cotangents(surface), 0)
    weight = np.clip(weight[:-1] + weight[surface.twin], _LEAST, _MOST)
    # Each edge is taken from one of its two triangles.
    edge = np.flatnonzero((surface.twin < 0) | (surface.twin > np.arange(len(weight))))
    here, there, weight = surface.node[edge], surface.node[following(edge)], weight[edge]
    value = -weight * (surface.transport[edge] if transported else 1.0)
    row, column = np.concatenate([there, here]), np.concatenate([here, there])
    diagonal = np.bincount(row, np.concatenate([weight, weight]), surface.node_count)
    return matrix_of(row, column, np.concatenate([value, np.conj(value)]), diagonal=diagonal)


def guided_field(surface: Surface, pull: np.ndarray, *, progress: Progress = silent) -> Field:
    """Solve for the field that follows a guide, given as direction times weight (nodes,) complex. An edge of the
    surface has about weight 1. Every loose part needs a guide somewhere.

    Where the guide reverses from one node to the next, the solution passes through zero and its direction flips. There
    the guide is dropped, and the field turns on a band a few edges wide."""
    bare = laplacian(surface)
    matrix = _with_diagonal(bare, np.abs(pull))
    progress("combing", 0.1)
    hierarchy = hierarchy_of(matrix)
    progress("combing", 0.2)
    tolerance = _TOLERANCE if (pull != 0).mean() > 0.5 else _SPARSE_TOLERANCE
    z, residual = solve(matrix, pull, hierarchy, tolerance=tolerance, progress=span_of(progress, 0.2, 0.8))
    return Field(_without_flips(surface, bare, unit_complex(z), progress=span_of(progress, 0.8, 1)), residual)


def smoothest_field(surface: Surface, *, progress: Progress = silent) -> Field:
    """Compute the smoothest field without a guide. The eigenvector of the smallest eigenvalue on the coarsest level is
    smoothed there and on every finer level, because it may nearly vanish on half of the surface."""
    kept = surface.mass * (_EVEN / surface.mass.sum())
    hierarchy = hierarchy_of(_with_diagonal(laplacian(surface), kept))
    progress("combing", 0.3)
    levels = hierarchy.levels
    z = _least_eigenvector(levels[-1])
    masses = [kept]
    for level in levels[:-1]:
        masses.append(np.bincount(level.joined, masses[-1] * np.abs(level.carry), len(level.seeds)))
    for level, mass in zip(levels[::-1], masses[::-1], strict=True):
        if level.coarse is not None:
            z = level.up(z).astype(complex)
        steps = _EVEN_STEPS if len(z) <= _COARSE else 1
        z, residual = _evened(level, mass, z, pull=np.zeros(len(z)), steps=steps)
    return Field(z, residual)


def _without_flips(surface: Surface, bare: Matrix, z: np.ndarray, *, progress: Progress) -> np.ndarray:
    """Recompute the field on a band around its flips; the field outside is fixed."""
    free = np.zeros(surface.node_count, bool)
    kept = surface.mass / (_BAND * surface.length) ** 2
    # One direction, added along the whole flip, decides to which side the field turns there.
    aside = surface.to_plane(np.array([0.6, 0.64, 0.48]))
    for attempt in range(_ATTEMPTS):
        torn = singular_triangles(surface, z).torn
        if not torn.any():
            break
        free |= _around(surface, torn, rings=_BAND)
        within, rim = free[bare.row] & free[bare.column], free[bare.row] & ~free[bare.column]
        number = np.cumsum(free) - 1
        ends = number[bare.row[within]], number[bare.column[within]]
        matrix = Matrix(bare.diagonal[free] + kept[free], *ends, bare.value[within])
        beside = -complex_sums(bare.row[rim], bare.value[rim] * z[bare.column[rim]], len(z))[free]
        z = z.copy()
        z[free], _ = _evened(hierarchy_of(matrix), kept[free], (z + aside)[free], pull=beside, steps=_EVEN_STEPS)
        progress("combing", (attempt + 1) / _ATTEMPTS)
    return z


def _evened(
    hierarchy: Hierarchy, kept: np.ndarray, z: np.ndarray, *, pull: np.ndarray, steps: int
) -> tuple[np.ndarray, float]:
    """Smooth a field and scale it back to length 1, several times.

    The hierarchy's matrix is the Laplacian plus the weights of the pull and the weights `kept` that hold the field. A
    smaller `kept` smooths farther. Singular points within the smoothing distance meet and vanish (diffusion generated
    motion: Viertel and Osting, "An approach to quad meshing based on harmonic cross-valued maps", 2019)."""
    for _ in range(steps):
        z = unit_complex(z)
        z, residual = solve(hierarchy.matrix, pull + kept * z, hierarchy, tolerance=_EVEN_TOLERANCE)
    return unit_complex(z), residual


def _around(surface: Surface, triangles: np.ndarray, *, rings: int) -> np.ndarray:
    """Whether each node lies within `rings` edges of one of the chosen triangles (m,)."""
    corners = surface.node.reshape(-1, 3)
    near = np.zeros(surface.node_count, bool)
    near[corners[triangles]] = True
    for _ in range(rings):
        near[corners[near[corners].any(axis=1)]] = True
    return near


def unit_complex(z: np.ndarray) -> np.ndarray:
    """Scale complex numbers to length 1; 0 becomes 1."""
    size = np.abs(z)
    return np.where(size > 0, z / np.where(size > 0, size, 1), 1)


def _cotangents(surface: Surface) -> np.ndarray:
    """Half the cotangent (3 m,) of the angle opposite to each corner's edge."""
    sides = surface.sides.reshape(-1, 3, 3)
    opposite = -np.einsum("ijk,ijk->ij", np.roll(sides, -1, axis=1), np.roll(sides, -2, axis=1))
    return (opposite / (4 * surface.areas[:, None])).ravel()


def _with_diagonal(matrix: Matrix, added: np.ndarray) -> Matrix:
    return Matrix(matrix.diagonal + added, matrix.row, matrix.column, matrix.value)


def _least_eigenvector(coarsest: Hierarchy) -> np.ndarray:
    """The eigenvector of a small matrix's smallest eigenvalue. Large matrices of nodes without neighbours get ones."""
    if coarsest.inverse is None:
        return np.ones(len(coarsest.matrix.diagonal), complex)
    return np.linalg.eigh(coarsest.inverse.astype(complex))[1][:, -1]
