# SPDX-License-Identifier: GPL-3.0-or-later
"""Guides of a comb: axes, UV, bones, strokes, and from head to tail."""

import numpy as np
import pytest

from precompute.mesh import guide
from precompute.mesh.direction_field import guided_field
from precompute.mesh.guide import head_to_tail
from precompute.mesh.surface import surface_of

from .shapes import branching, joined, sheet, sphere, tube


def directions(surface, pull):
    """The unit vectors (nodes, 3) of a pull, where it is not zero, and the nodes' points."""
    vectors = surface.to_space(pull)
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.maximum(size, 1e-300), surface.points[surface.point_of_node]


def test_an_axis_pulls_along_the_surface_and_not_across_it():
    surface = surface_of(*sphere(4))
    pull = guide.along_axis(surface, np.array([0.0, 0, 3.0]))
    vectors, points = directions(surface, pull)
    equator, poles = np.abs(points[:, 2]) < 0.1, np.abs(points[:, 2]) > 0.98
    assert vectors[equator, 2].min() > 0.99
    weight = np.abs(pull) / surface.mass
    assert weight[poles].max() < 0.3 * weight[equator].min()


def test_u_pulls_along_u_whichever_way_the_map_is_wound():
    points, triangles = sheet()
    surface = surface_of(points, triangles)
    for v in (1, -1):
        uv = (points[:, :2] * [2, v])[surface.triangles]
        vectors, _ = directions(surface, guide.along_uv(surface, uv))
        assert vectors[:, 0].min() > 0.9 and np.abs(vectors[:, 1]).max() < 0.05
    assert (guide.along_uv(surface, np.zeros((len(surface.triangles), 3, 2))) == 0).all()


def test_bones_pull_along_the_nearest():
    surface = surface_of(*tube(along=200))
    bones = np.array([[[0, 0, 0], [5, 0, 0]], [[10, 0, 0], [5, 0, 0]]], float)
    vectors, points = directions(surface, guide.along_bones(surface, bones))
    assert (vectors[points[:, 0] < 4, 0] > 0.99).all() and (vectors[points[:, 0] > 6, 0] < -0.99).all()


def test_one_stroke_combs_a_whole_body():
    surface = surface_of(*tube())
    pull = guide.along_strokes(surface, np.array([[[1, 0, 0.48], [2, 0, 0.45]]]))
    assert 5 <= (pull != 0).sum() <= 20
    vectors, _ = directions(surface, guided_field(surface, pull).direction)
    assert vectors[:, 0].min() > 0.99


def test_a_part_without_a_stroke_follows_the_nearest_stroke():
    points, triangles = sphere(2)
    far = joined(tube(), (points * 0.2 + [9, 0, 1], triangles), (points * 0.2 + [1, 0, 1], triangles))
    surface = surface_of(*far)
    strokes = np.array([[[1, 0, 0.48], [2, 0, 0.45]], [[9.5, 0, 0.22], [8.5, 0, 0.25]]])
    vectors, at = directions(surface, guide.along_strokes(surface, strokes))
    ball = (at[:, 2] > 0.75) & (np.abs(at[:, 0] - np.rint(at[:, 0])) < 0.1)
    assert (vectors[ball & (at[:, 0] > 5), 0] < -0.5).all() and (vectors[ball & (at[:, 0] < 5), 0] > 0.5).all()


def test_a_part_that_nothing_pulls_follows_its_longest_side():
    points, triangles = sheet()
    flat = points * [1, 3, 0]
    surface = surface_of(*joined((flat, triangles), sphere(2)))
    pull = guide.along_axis(surface, np.array([0.0, 0, 1]))
    vectors, at = directions(surface, guide.where_bare(surface, pull))
    of_sheet = surface.parts[surface.point_of_node < len(flat)][0]
    np.testing.assert_allclose(vectors[surface.parts == of_sheet], np.tile([0, 1, 0], (len(flat), 1)), atol=1e-9)
    other = surface.parts != of_sheet
    np.testing.assert_array_equal(guide.where_bare(surface, pull)[other], pull[other])


@pytest.mark.parametrize("turned", [False, True])
def test_head_to_tail_runs_from_the_thick_end(turned):
    points, triangles = tube(along=200)
    points = points * [-1, -1, 1] if turned else points
    surface = surface_of(points, triangles)
    vectors, at = directions(surface, guided_field(surface, head_to_tail(surface)).direction)
    middle = np.abs(np.abs(at[:, 0]) - 5) < 2
    # The field may swirl around the head itself; from one girth (3) on it runs along the body.
    assert np.degrees(np.arccos(vectors[middle, 0] * (-1 if turned else 1))).max() < 3


def test_head_to_tail_runs_out_along_branches():
    surface = surface_of(*branching())
    vectors, at = directions(surface, guided_field(surface, head_to_tail(surface)).direction)
    out, angle = np.hypot(*at.T[:2]), np.arctan2(at[:, 1], at[:, 0])
    outwards = (vectors * at)[:, :2].sum(axis=1) / np.maximum(out, 1e-9)
    arms = [(np.abs(angle - arm) < 0.2) & (1.2 < out) & (out < 2.2) for arm in np.radians([0, 120, -120])]
    one, *others = sorted((outwards[arm] for arm in arms), key=np.median)
    # Into one arm and out of the two others. The arms' flanks slope, so T is not exactly along them.
    assert one.max() < -0.3 and all(other.min() > 0.3 for other in others)


def test_parts_beside_the_body_run_as_it_does():
    points, triangles = sphere(2)
    surface = surface_of(*joined(tube(along=200), (points * 0.1 + [5, 0, 0.6], triangles)))
    vectors, at = directions(surface, head_to_tail(surface))
    eye = at[:, 2] > 0.52
    assert np.median(vectors[eye, 0]) > 0.8


def test_only_bare_parts_take_the_pull_of_a_part():
    points, triangles = sphere(2)
    surface = surface_of(*joined((points, triangles), (points + 3, triangles)))
    pull = guide.along_triangles(surface, np.tile([1.0, 0, 0], (len(surface.triangles), 1)))
    np.testing.assert_array_equal(guide.like_part(surface, pull, 0), pull)
    first = np.where(surface.parts == 0, pull, 0)
    vectors, _ = directions(surface, guide.like_part(surface, first, 0))
    # At two points of the sphere, and their neighbours, the body's direction is normal to the surface.
    assert (np.linalg.norm(vectors, axis=1) > 0.99).mean() > 0.9
