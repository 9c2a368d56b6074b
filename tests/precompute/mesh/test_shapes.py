# SPDX-License-Identifier: GPL-3.0-or-later
"""The shapes that show a grating have their sizes, and their UV maps the directions that they promise."""

import numpy as np
import pytest

from precompute.mesh.shapes import BALL_RADIUS_M, CLEAR_M, SHEET_M, WRITTEN_M, Shape, ball, bent_sheet, ring


def normals(shape: Shape) -> np.ndarray:
    edges = np.diff(shape.points[shape.quads], axis=1)
    return np.cross(edges[:, 0] + edges[:, 1], edges[:, 1] + edges[:, 2])


def test_tracks_of_a_disc_run_round():
    points, quads, uv = ring(CLEAR_M, WRITTEN_M, 0.0)
    radius = np.linalg.norm(points[:, :2], axis=1)[quads]
    assert (
        (uv[..., 0] > uv[..., 0].mean(axis=1, keepdims=True)) == (radius > radius.mean(axis=1, keepdims=True))
    ).all()


@pytest.mark.parametrize("shape", [ring(CLEAR_M, WRITTEN_M, 0.0), bent_sheet()])
def test_a_disc_and_a_sheet_face_upwards(shape):
    assert (normals(shape)[:, 2] > 0).all()


def test_a_ball_faces_outwards_and_stands_on_the_floor():
    shape = ball()
    middles = shape.points[shape.quads].mean(axis=1) - (0, 0, BALL_RADIUS_M)
    assert ((normals(shape) * middles).sum(axis=1) > 0).all()
    assert shape.points[:, 2].min() == pytest.approx(0, abs=1e-12)


def test_the_sheet_keeps_its_size_where_it_bends():
    cells = 96
    shape = bent_sheet(cells)
    assert shape.uv.min() == 0 and shape.uv.max() == 1
    points, middle = shape.points.reshape(cells, cells, 3), cells // 2
    for line, size in zip((points[middle], points[:, middle]), SHEET_M, strict=True):
        length = np.linalg.norm(np.diff(line, axis=0), axis=-1).sum()
        assert length == pytest.approx(size, rel=0.02)
