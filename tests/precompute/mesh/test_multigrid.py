# SPDX-License-Identifier: GPL-3.0-or-later
"""Sparse systems against dense ones."""

import numpy as np
import pytest

from precompute.mesh.direction_field import Matrix, hierarchy_of, laplacian, matrix_of, solve
from precompute.mesh.surface import surface_of

from .shapes import torus


@pytest.fixture(scope="module")
def system():
    """A connection Laplacian of 2048 nodes, slightly shifted, and a right-hand side."""
    surface = surface_of(*torus(jitter=0.4))
    bare = laplacian(surface)
    random = np.random.default_rng(2)
    b = random.standard_normal(surface.node_count) + 1j * random.standard_normal(surface.node_count)
    return Matrix(bare.diagonal + 1e-3, bare.row, bare.column, bare.value), b


def test_a_matrix_adds_entries_of_the_same_place():
    row, column = np.array([1, 0, 1, 2, 0]), np.array([0, 1, 0, 2, 1])
    matrix = matrix_of(row, column, np.array([1j, 2.0, 3j, 5.0, 1.0]), diagonal=np.array([1.0, 1, 1, 7]))
    dense = np.array([[1, 3, 0, 0], [4j, 1, 0, 0], [0, 0, 6, 0], [0, 0, 0, 7]])
    np.testing.assert_array_equal(matrix.dense(), dense)
    np.testing.assert_array_equal(matrix @ np.arange(1.0, 5.0), dense @ np.arange(1.0, 5.0))
    np.testing.assert_array_equal(matrix.of_rows(np.abs(matrix.value), np.maximum), [3, 4, 0, 0])
    assert matrix.single().value.dtype == np.complex64


def test_the_solution_is_that_of_the_dense_system(system):
    matrix, b = system
    x, residual = solve(matrix, b, hierarchy_of(matrix), tolerance=1e-10)
    assert residual <= 1e-10
    exact = np.linalg.solve(matrix.dense(), b)
    # The matrix's condition number is at most 6 / 1e-3.
    assert np.linalg.norm(x - exact) < 1e-10 * 6e3 * np.linalg.norm(exact)


@pytest.mark.night("test_the_solution_is_that_of_the_dense_system")
def test_it_takes_few_steps_whatever_the_size():
    """Without the hierarchy the number of steps would double with the mesh's width, to hundreds."""
    steps = []
    for around in (40, 160):
        surface = surface_of(*torus(2 * around, around, jitter=0.3))
        bare = laplacian(surface)
        matrix = Matrix(bare.diagonal + 1e-3 * surface.mass, bare.row, bare.column, bare.value)
        steps.clear()
        solve(matrix, np.ones(len(bare.diagonal), complex), hierarchy_of(matrix), progress=lambda *_: steps.append(1))
        assert len(steps) < 40


def test_a_cycle_is_hermitian_and_positive(system):
    matrix, b = system
    hierarchy = hierarchy_of(matrix)
    other = np.roll(b, 7)
    here, there = (
        np.vdot(other, hierarchy.apply(b.astype(np.complex64))),
        np.vdot(hierarchy.apply(other.astype(np.complex64)), b),
    )
    # Two sums of 2048 terms in single precision.
    assert abs(here - there) < 1e-4 * abs(np.linalg.norm(b) ** 2)
    assert np.vdot(b, hierarchy.apply(b.astype(np.complex64))).real > 0


def test_going_up_and_down_are_adjoint(system):
    matrix, b = system
    hierarchy = hierarchy_of(matrix)
    coarse = b[: len(hierarchy.seeds)]
    assert np.vdot(b, hierarchy.up(coarse)) == pytest.approx(np.vdot(hierarchy.down(b), coarse), rel=1e-5)
    assert len(hierarchy.levels) >= 2 and hierarchy.levels[-1].inverse is not None


def test_nodes_without_neighbours_are_solved_too():
    diagonal = np.arange(1.0, 1001.0)
    empty = np.zeros(0, int)
    matrix = Matrix(diagonal, empty, empty, np.zeros(0, complex))
    x, residual = solve(matrix, np.ones(1000, complex), hierarchy_of(matrix))
    np.testing.assert_allclose(x, 1 / diagonal, rtol=1e-8)
    assert residual < 1e-8


def test_nothing_asked_is_nothing():
    matrix = Matrix(np.ones(3), np.zeros(0, int), np.zeros(0, int), np.zeros(0))
    assert (solve(matrix, np.zeros(3), hierarchy_of(matrix))[0] == 0).all()
