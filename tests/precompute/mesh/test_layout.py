# SPDX-License-Identifier: GPL-3.0-or-later
"""The UV map and the turns that carry a field."""

import numpy as np
import pytest

from precompute.base.failure import GratingError
from precompute.mesh.comb import GUIDES, comb
from precompute.mesh.layout import Polygons, corner_directions, lay, uv_directions
from precompute.mesh.surface import surface_of

from .shapes import joined, polygons_of, sheet, sphere, torus


def carried(polygons, uv, turn):
    """A renderer's directions (corners, 3): each triangle's U in the corner's tangent plane, turned."""
    corners = polygons.corners
    at, on = polygons.points[polygons.point[corners]], uv[corners].astype(float)
    by_uv = on[:, 1:] - on[:, :1]
    along = np.linalg.solve(by_uv, at[:, 1:] - at[:, :1])[:, 0]
    n = polygons.normals[corners]
    across = along[:, None] - n * (n * along[:, None]).sum(axis=2, keepdims=True)
    t = across / np.linalg.norm(across, axis=2, keepdims=True)
    c, s = turn[corners, 0, None], turn[corners, 1, None]
    return t * c + np.cross(n, t) * s


@pytest.mark.parametrize("mesh", [torus(), sphere(3)])
def test_the_map_and_the_turn_give_the_field_back(mesh):
    polygons = polygons_of(*mesh)
    surface = surface_of(polygons.points, polygons.triangles)
    random = np.random.default_rng(4).uniform(-1, 1, surface.node_count)
    directions = corner_directions(polygons, surface, np.exp(1j * random))
    np.testing.assert_allclose((directions * polygons.normals).sum(axis=1), 0, atol=1e-9)
    uv, turn = lay(polygons, directions)
    # The turn was computed from the rounded map, so only its own single precision is left.
    np.testing.assert_allclose(carried(polygons, uv, turn), directions[polygons.corners], atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(turn, axis=1), 1, atol=1e-6)


def test_the_u_of_a_map_is_the_mean_over_what_is_sewn():
    """Around a torus U runs along circles. A triangle's U leaves the circle by half an edge, 2 pi / 128, the mean at a
    point only by the difference of two neighbours. At a seam each side has its own mean."""
    polygons = polygons_of(*torus())
    along = np.cross([0.0, 0.0, 1.0], polygons.points[polygons.point])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    uv = uv_of_torus()
    sewn = uv_directions(polygons, uv)
    np.testing.assert_allclose((sewn * polygons.normals).sum(axis=1), 0, atol=1e-9)
    off = np.arccos(np.clip(np.abs((sewn * along).sum(axis=1)), 0, 1))
    assert np.median(off) < 2 * np.pi / 128 / 4
    apart = uv_directions(polygons, uv + 10 * np.repeat(np.arange(len(uv) // 3), 3)[:, None])
    assert np.median(np.arccos(np.clip(np.abs((apart * along).sum(axis=1)), 0, 1))) > 2 * np.pi / 128 / 4


def test_a_copy_of_a_map_is_that_map():
    polygons = polygons_of(*torus())
    uv = uv_of_torus()
    combed = comb("torus", polygons, {"guide": np.array("copy"), "uv": uv})
    np.testing.assert_array_equal(combed.directions, uv_directions(polygons, uv))
    np.testing.assert_allclose(
        carried(polygons, combed.uv, combed.turn), combed.directions[polygons.corners], atol=1e-6
    )
    assert not len(combed.triangle)


def test_no_two_faces_touch_in_the_map():
    polygons = polygons_of(*torus())
    combed = comb("torus", polygons, {"guide": np.array("axis"), "axis": np.array([1.0, 0, 0])})
    face = combed.uv.reshape(-1, 3, 2).astype(float)
    assert face.min() > 0 and face.max() < 1
    low, high = face.min(axis=1), face.max(axis=1)
    side = int(np.ceil(np.sqrt(len(face))))
    np.testing.assert_array_equal(np.floor(low * side), np.floor(high * side))
    cells = np.floor(low * side) @ [1, side]
    assert len(np.unique(cells)) == len(face)


def test_u_is_the_mean_on_a_face_and_the_turn_small():
    combed = comb("torus", polygons_of(*torus()), {"guide": np.array("uv"), "uv": uv_of_torus()})
    # Over a face the field turns by no more than its longer edge bends: 2 pi / 32.
    assert combed.turn[:, 0].min() > np.cos(2 * np.pi / 32)


def uv_of_torus():
    """U around the torus, by the corners of its faces; the seam's faces have no area there."""
    _, triangles = torus()
    u, v = np.divmod(triangles.ravel(), 32)
    return np.stack([u / 64, v / 32], axis=1)


def test_a_face_of_more_corners_than_three_is_one_island():
    points, _ = sheet(5, 5)
    quads = (5 * np.arange(4)[:, None] + np.arange(4)).reshape(-1, 1) + [0, 1, 6, 5]
    first = 4 * np.arange(16)
    corners = np.stack([first[:, None] + [0, 1, 2], first[:, None] + [0, 2, 3]], axis=1).reshape(-1, 3)
    normals = np.tile([0.0, 0, 1], (64, 1))
    polygons = Polygons(points * [1, 1, 0], quads.ravel(), normals, corners, np.repeat(np.arange(16), 2))
    combed = comb("sheet", polygons, {"guide": np.array("axis"), "axis": np.array([1.0, 1, 0])})
    np.testing.assert_allclose(combed.directions, np.tile([0.5**0.5, 0.5**0.5, 0], (64, 1)), atol=1e-6)
    np.testing.assert_allclose(carried(polygons, combed.uv, combed.turn)[:, :, :2], 0.5**0.5, atol=1e-5)


def test_faces_without_area_are_carried_along():
    points, triangles = sphere(2)
    polygons = polygons_of(points, np.concatenate([triangles, [[0, 0, 1], [2, 2, 2]]]))
    combed = comb("sphere", polygons, {"guide": np.array("smoothest")})
    assert np.isfinite(combed.uv).all()
    np.testing.assert_allclose(np.linalg.norm(combed.directions, axis=1), 1, atol=1e-6)
    assert combed.index.sum() == 2


@pytest.mark.parametrize("guide", GUIDES)
def test_every_guide_combs_a_mesh_of_parts(guide):
    mesh = joined(torus(24, 12), (sphere(2)[0] * 0.3 + 2, sphere(2)[1]))
    given = {
        "axis": np.array([0.0, 0, 1]),
        "uv": np.random.default_rng(5).uniform(size=(mesh[1].size, 2)),
        "segments": np.array([[[1.4, 0, 0], [1.4, 0.3, 0]]]),
    }
    told = []
    request = {"guide": np.array(guide), **given}
    combed = comb("parts", polygons_of(*mesh), request, progress=lambda *now: told.append(now[1]))
    np.testing.assert_allclose(np.linalg.norm(combed.directions, axis=1), 1, atol=1e-6)
    # Random UV contradicts itself at every edge, and flips are reported.
    if guide != "copy":  # its seams are the torus's own
        assert combed.index.sum() == 2
    assert told[-1] == 1.0 and min(told) >= 0


@pytest.mark.parametrize(("mesh", "request_", "fault"), [
    ((np.zeros((3, 3)), np.zeros((0, 3), int)), {"guide": "axis"}, "no faces"),
    ((np.zeros((3, 3)), np.array([[0, 1, 2]])), {"guide": "axis"}, "no area"),
    ((np.full((3, 3), np.nan), np.array([[0, 1, 2]])), {"guide": "axis"}, "not numbers"),
    (sphere(1), {"guide": "strokes", "segments": np.zeros((0, 2, 3))}, "no strokes"),
    (sphere(1), {"guide": "strokes", "segments": np.zeros((4, 2, 3))}, "no strokes"),
    (sphere(1), {"guide": "bones", "segments": np.zeros((0, 2, 3))}, "no bones"),
])  # fmt: skip
def test_faults_name_the_mesh(mesh, request_, fault):
    with pytest.raises(GratingError, match=f"^Suzanne: .*{fault}"):
        comb("Suzanne", polygons_of(*mesh), {key: np.array(value) for key, value in request_.items()})
