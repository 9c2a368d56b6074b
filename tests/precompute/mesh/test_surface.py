# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes, tangent planes and curvature of triangle meshes."""

import numpy as np
import pytest

from precompute.mesh.surface import complex_sums, following, n_turned, preceding, surface_of, unit

from .shapes import book, branching, joined, sheet, sphere, torus


def spread(surface):
    """The number of nodes of each point."""
    return np.bincount(surface.point_of_node, minlength=len(surface.points))


@pytest.mark.parametrize(("mesh", "euler"), [(sphere(3), 2), (torus(), 0), (branching(), 2)])
def test_the_curvature_of_a_closed_surface_adds_up_to_its_euler_characteristic(mesh, euler):
    surface = surface_of(*mesh)
    assert (spread(surface) == 1).all() and not surface.is_open.any()
    assert surface.curvature.sum() / (2 * np.pi) == pytest.approx(euler, abs=1e-9)


def test_around_a_triangle_the_transport_turns_by_its_curvature():
    surface = surface_of(*torus())
    around = surface.transport.reshape(-1, 3).prod(axis=1)
    np.testing.assert_allclose(around, np.exp(1j * surface.curvature), atol=1e-9)


def test_frames_are_orthonormal_and_polar_angles_lie_along_the_edges():
    surface = surface_of(*sphere(4))
    x, y, n = surface.frames
    for a, b in ((x, y), (x, n), (y, n)):
        np.testing.assert_allclose((a * b).sum(axis=1), 0, atol=1e-12)
    # The outward normal of the unit sphere is the point itself; triangles of 6 degrees turn their normals by less.
    assert (n * surface.points[surface.point_of_node]).sum(axis=1).min() > np.cos(np.radians(6))
    along = surface.to_complex(surface.sides)
    off = np.angle(along * np.exp(-1j * surface.polar))
    # The angles around a node are stretched to a full turn, which moves none by more than 5 degrees on this sphere.
    assert np.degrees(np.abs(off)).max() < 5


def test_a_vector_goes_to_the_plane_and_back():
    surface = surface_of(*torus())
    vector = surface.to_space(np.full(surface.node_count, 0.6 + 0.8j))
    np.testing.assert_allclose(surface.to_plane(vector), 0.6 + 0.8j, atol=1e-12)


def test_loose_parts_are_told_apart():
    points, triangles = sphere(2)
    surface = surface_of(*joined((points, triangles), (points + 3, triangles), torus()))
    assert surface.parts.max() == 2
    assert len(np.unique(surface.parts[surface.node[: triangles.size]])) == 1


def test_sheets_are_cut_apart_at_an_edge_of_three_faces():
    surface = surface_of(*book())
    assert spread(surface).max() == 3 and surface.parts.max() == 2


def test_sheets_of_opposite_winding_are_cut_apart():
    points, triangles = sheet()
    turned = triangles.copy()
    turned[points[triangles].mean(axis=1)[:, 0] > 1] = turned[points[triangles].mean(axis=1)[:, 0] > 1][:, ::-1]
    assert surface_of(points, turned).parts.max() == 1


def test_triangles_without_area_are_left_out():
    points, triangles = sphere(2)
    surface = surface_of(points, np.concatenate([triangles, [[0, 0, 1], [2, 2, 2]]]))
    np.testing.assert_array_equal(surface.kept, np.arange(len(triangles)))
    assert not len(surface_of(np.zeros((3, 3)), np.array([[0, 1, 2]])).triangles)


def test_the_rim_of_a_sheet_is_open():
    surface = surface_of(*sheet(20, 30))
    assert surface.is_open.sum() == 2 * 20 + 2 * 28
    assert (surface.twin < 0).sum() == 2 * 19 + 2 * 29


def test_areas_and_masses():
    surface = surface_of(*sphere(5))
    # The inscribed polyhedron of 4096 faces has 0.1 % less area than the sphere.
    assert surface.areas.sum() == pytest.approx(4 * np.pi, rel=2e-3)
    assert surface.mass.sum() == pytest.approx(surface.areas.sum())
    assert surface.length == pytest.approx(np.linalg.norm(surface.sides, axis=1).mean())


def test_corners_of_a_triangle_in_turn():
    np.testing.assert_array_equal(following(np.arange(6)), [1, 2, 0, 4, 5, 3])
    np.testing.assert_array_equal(preceding(np.arange(6)), [2, 0, 1, 5, 3, 4])


def test_small_helpers():
    np.testing.assert_array_equal(unit(np.array([[0, 0, 0], [0, 3, 4]])), [[0, 0, 1], [0, 0.6, 0.8]])
    np.testing.assert_array_equal(complex_sums(np.array([0, 2, 2]), np.array([1j, 2, 3j]), 3), [1j, 0, 2 + 3j])
    turned = n_turned(np.array([[1, 0, 0]]), np.array([[0, 1, 0]]), np.array([3 + 4j]))
    np.testing.assert_array_equal(turned, [[3, 4, 0]])
