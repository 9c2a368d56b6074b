# SPDX-License-Identifier: GPL-3.0-or-later
"""Solves large sparse Hermitian systems that are positive definite with dominant diagonals: conjugate gradients,
preconditioned by aggregation multigrid (Notay, "An aggregation-based algebraic multigrid method", 2010).

Conjugate gradients alone take as many steps as the mesh has edges across. Each level of the multigrid joins some nodes
around a seed. The system's own coefficients carry a field from the seed to these nodes, so a smooth field stays smooth.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..base.progress import Progress, silent

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
