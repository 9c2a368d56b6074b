# SPDX-License-Identifier: GPL-3.0-or-later
"""The smoothest field of unit directions on a surface that follows a guide, and where a field turns.

The field z minimises |grad z|^2 + sum of w |z - g|^2 over the nodes: the connection Laplacian of Knöppel et al. 2013,
and the guide's directions g with weights w. Without a guide, z is the eigenvector of the Laplacian's smallest
eigenvalue. Finally each z is scaled to length 1.

The system is large, sparse, Hermitian and positive definite with a dominant diagonal. It is solved by conjugate
gradients, preconditioned by aggregation multigrid (Notay, "An aggregation-based algebraic multigrid method", 2010).
Conjugate gradients alone take as many steps as the mesh has edges across. Each level of the multigrid joins some nodes
around a seed. The system's own coefficients carry a field from the seed to these nodes, so a smooth field stays
smooth."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..base.progress import Progress, silent, span_of
from .surface import Surface, complex_sums, following

# A system of at most this size is inverted directly.
_SMALL = 300
# Neighbours are joined only if their coefficient is at least this share of a node's greatest.
_STRONG = 0.2
# Steps of the Chebyshev smoother for the upper part, from 0.4 to 2, of the spectrum of D^-1 A.
_STEPS = (0.566, 1.577)
_ITERATIONS_MAX = 200


@dataclass(frozen=True)
class Matrix:
    """A sparse square matrix.

    diagonal  (n,)
    row       (k,) of each off-diagonal entry, in ascending order
    column    (k,)
    value     (k,)"""

    diagonal: np.ndarray
    row: np.ndarray
    column: np.ndarray
    value: np.ndarray

    @cached_property
    def starts(self) -> np.ndarray:
        """The index of the first entry of each row that has entries."""
        return np.flatnonzero(np.diff(self.row, prepend=-1))

    def __matmul__(self, x: np.ndarray) -> np.ndarray:
        return self.diagonal * x + self.of_rows(self.value * x[self.column], np.add)

    def of_rows(self, values: np.ndarray, ufunc: np.ufunc) -> np.ndarray:
        """Reduce values (k,) at the entries over each row: (n,); 0 in a row without entries."""
        reduced = np.zeros(len(self.diagonal), values.dtype)
        if len(self.row):
            reduced[self.row[self.starts]] = ufunc.reduceat(values, self.starts)
        return reduced

    def single(self) -> Matrix:
        """Convert the matrix to single precision."""
        kind = np.complex64 if np.iscomplexobj(self.value) else np.float32
        return Matrix(self.diagonal.astype(np.float32), self.row, self.column, self.value.astype(kind))

    def dense(self) -> np.ndarray:
        """Convert the matrix to an array (n, n)."""
        full = np.diag(self.diagonal).astype(self.value.dtype)
        full[self.row, self.column] = self.value
        return full


def matrix_of(row: np.ndarray, column: np.ndarray, value: np.ndarray, *, diagonal: np.ndarray) -> Matrix:
    """Build a matrix from entries in any order. Entries at the same place are added, also on the diagonal, whose sums
    are real."""
    count = len(diagonal)
    here = row == column
    diagonal = diagonal + np.bincount(row[here], value[here].real, count)
    row, column, value = row[~here], column[~here], value[~here]
    key = row * count + column
    order = np.argsort(key, kind="stable")
    key = key[order]
    new = np.flatnonzero(np.diff(key, prepend=-1))
    value = np.add.reduceat(value[order], new) if len(new) else value
    return Matrix(diagonal, key[new] // count, key[new] % count, value)


@dataclass(frozen=True)
class Hierarchy:
    """A matrix in single precision and, unless it is small, the coarser matrix of its joined nodes.

    matrix   of n nodes
    seeds    (coarse,) the node from which each joined node is made; empty if the matrix is small
    joined   (n,) the joined node of each node; arbitrary, with carry 0, for a node without neighbours; empty if the
             matrix is small
    carry    (n,) the factor from the joined node to each node; empty if the matrix is small
    coarse   the hierarchy of the joined nodes, or None
    inverse  of a small matrix, (n, n), or None"""

    matrix: Matrix
    seeds: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    joined: np.ndarray = field(default_factory=lambda: np.zeros(0, int))
    carry: np.ndarray = field(default_factory=lambda: np.zeros(0))
    coarse: Hierarchy | None = None
    inverse: np.ndarray | None = None

    def apply(self, b: np.ndarray) -> np.ndarray:
        """Approximate the solution x of A x = b by one cycle, which visits each coarser level twice as often."""
        if self.inverse is not None:
            return self.inverse @ b
        x = np.zeros_like(b)
        residual = b
        for step in _STEPS:
            x = x + step * residual / self.matrix.diagonal
            residual = b - self.matrix @ x
        if self.coarse is not None:
            down = self.down(residual)
            guess = self.coarse.apply(down)
            if self.coarse.coarse is not None:
                guess = guess + self.coarse.apply(down - self.coarse.matrix @ guess)
            x = x + self.up(guess)
        for step in _STEPS[::-1]:
            x = x + step * (b - self.matrix @ x) / self.matrix.diagonal
        return x

    def up(self, coarse: np.ndarray) -> np.ndarray:
        """Carry a vector from the joined nodes to the nodes."""
        return self.carry * coarse[self.joined]

    def down(self, fine: np.ndarray) -> np.ndarray:
        """Apply the adjoint of `up`."""
        values, count = np.conj(self.carry) * fine, len(self.seeds)
        sums: np.ndarray = np.bincount(self.joined, values.real, count)
        if np.iscomplexobj(values):
            sums = sums + 1j * np.bincount(self.joined, values.imag, count)
        return sums.astype(fine.dtype)

    @property
    def levels(self) -> list[Hierarchy]:
        """All levels, from this one to the coarsest."""
        return [self, *(self.coarse.levels if self.coarse is not None else [])]


def hierarchy_of(matrix: Matrix) -> Hierarchy:
    """Build the hierarchy of a Hermitian, positive definite matrix with a dominant diagonal."""
    count = len(matrix.diagonal)
    if count <= _SMALL:
        inverse = np.linalg.inv(matrix.dense())
        return Hierarchy(matrix.single(), inverse=inverse.astype(matrix.single().value.dtype))
    seeds, joined, carry = _aggregates(matrix)
    if len(seeds) > 0.9 * count or not len(seeds):
        return Hierarchy(matrix.single())
    value = np.conj(carry[matrix.row]) * matrix.value * carry[matrix.column]
    own = np.bincount(joined, matrix.diagonal * np.abs(carry) ** 2, len(seeds))
    coarse = matrix_of(joined[matrix.row], joined[matrix.column], value, diagonal=own)
    single = matrix.single()
    return Hierarchy(single, seeds, joined, carry.astype(single.value.dtype), hierarchy_of(coarse))


def solve(
    matrix: Matrix, b: np.ndarray, hierarchy: Hierarchy, *, guess: np.ndarray | None = None, tolerance: float = 1e-9,
    progress: Progress = silent,
) -> tuple[np.ndarray, float]:  # fmt: skip
    """Solve A x = b by conjugate gradients. Returns x and its residual |b - A x| / |b|. Stops below the tolerance or
    after _ITERATIONS_MAX steps."""
    x = np.zeros_like(b) if guess is None else guess
    residual = b - matrix @ x
    size = np.linalg.norm(b)
    if size == 0:
        return np.zeros_like(b), 0.0
    first = left = np.linalg.norm(residual) / size
    direction, before = np.zeros_like(b), 1.0
    for _ in range(_ITERATIONS_MAX):
        if left <= tolerance:
            break
        smoothed = hierarchy.apply((residual / (left * size)).astype(hierarchy.matrix.value.dtype)) * (left * size)
        now = np.vdot(residual, smoothed).real
        direction = smoothed + (now / before) * direction
        before = now
        along = matrix @ direction
        step = now / np.vdot(direction, along).real
        x = x + step * direction
        residual = residual - step * along
        left = np.linalg.norm(residual) / size
        progress("combing", min(1.0, np.log(left / first) / np.log(tolerance / first)))
    return x, float(left)


def _aggregates(matrix: Matrix) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The seeds, the seed's index for each node, and the factor from the seed to the node. The factor is 0 for a node
    without neighbours, which the smoother solves alone."""
    count = len(matrix.diagonal)
    size = np.abs(matrix.value)
    most = matrix.of_rows(size, np.maximum)
    strong = size >= _STRONG * np.minimum(most[matrix.row], most[matrix.column])
    row, column, value, size = matrix.row[strong], matrix.column[strong], matrix.value[strong], size[strong]
    links = Matrix(matrix.diagonal, row, column, value)
    seeds = _independent(links)
    place = np.full(count, -1)
    place[seeds] = np.arange(len(seeds))
    joined, carry = np.maximum(place, 0), np.zeros(count, value.dtype)
    carry[seeds] = 1
    to_seed = np.flatnonzero((place[column] >= 0) & (place[row] < 0))
    # The strongest of a node's links to seeds is written last.
    to_seed = to_seed[np.argsort(size[to_seed], kind="stable")]
    joined[row[to_seed]] = place[column[to_seed]]
    carry[row[to_seed]] = -value[to_seed] / size[to_seed]
    return seeds, joined, carry


def _independent(links: Matrix) -> np.ndarray:
    """Choose unlinked nodes so that every other node with links is linked to a chosen one (Luby's method)."""
    count = len(links.diagonal)
    rank = np.random.default_rng(0).permutation(count).astype(np.int32) + 1
    linked = links.of_rows(np.ones(len(links.row), np.int8), np.maximum) > 0
    undecided = linked.copy()
    seed = np.zeros(count, bool)
    while undecided.any():
        highest = links.of_rows(np.where(undecided, rank, 0)[links.column], np.maximum)
        new = undecided & (rank > highest)
        seed |= new
        undecided &= ~new & (links.of_rows(new[links.column].astype(np.int8), np.maximum) == 0)
    return np.flatnonzero(seed)


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


# A field that turns by more than a right angle across one edge is not smooth.
_FLIP = np.pi / 2


@dataclass(frozen=True)
class Singular:
    """index  (m,) how often the field turns around each triangle, against the surface: 0 where it is regular. On a
              closed surface the sum is the Euler characteristic (Poincaré and Hopf)
    torn   (m,) whether the field flips across an edge of the triangle although its index is 0"""

    index: np.ndarray
    torn: np.ndarray


def singular_triangles(surface: Surface, direction: np.ndarray) -> Singular:
    """Find the singular triangles of a direction field (nodes,)."""
    turns = edge_turns(surface, direction).reshape(-1, 3)
    index = np.rint((turns.sum(axis=1) + surface.curvature) / (2 * np.pi)).astype(int)
    near = np.bincount(surface.node, np.repeat(index != 0, 3), surface.node_count)[surface.node] > 0
    torn = (np.abs(turns) > _FLIP).any(axis=1) & ~near.reshape(-1, 3).any(axis=1)
    return Singular(index, torn)


def edge_turns(surface: Surface, direction: np.ndarray) -> np.ndarray:
    """The angle (3 m,), from -pi to pi, by which a field turns along each corner's edge."""
    here = surface.node
    there = here[following(np.arange(len(here)))]
    return np.angle(direction[there] * np.conj(surface.transport * direction[here]))
