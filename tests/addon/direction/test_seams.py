# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a UV map turns between neighbouring faces, and the warnings about it."""

import bpy
import numpy as np
import pytest

from tests.addon.conftest import reports, select


def test_islands_are_told(scene, grating, addon, capfd):
    bpy.ops.mesh.primitive_monkey_add()
    said = reports(bpy.ops.grating.assign, capfd)
    assert "Suzanne: " in said and "UV islands; the colours jump where they meet" in said


def test_a_map_whose_direction_goes_on_is_told_nothing(scene, grating, addon, capfd):
    """A plane has no seam. Blender's sphere and tube each have one, with U in the same direction on both sides."""
    bpy.ops.mesh.primitive_uv_sphere_add()
    sphere = bpy.context.object
    bpy.ops.mesh.primitive_cylinder_add(end_fill_type="NOTHING")
    select(bpy.context.object, sphere)
    assert "UV" not in reports(bpy.ops.grating.assign, capfd)


def grid(count):
    """A square of count x count faces, each of size 1, whose UV map is the plane itself."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=count, y_subdivisions=count, size=count)
    return bpy.context.object


def turn_uv(mesh, faces, quarters):
    """Turn the UV map of the masked faces about the map's origin."""
    layer = mesh.uv_layers[0].uv
    uv = np.empty(2 * len(layer), np.float32)
    layer.foreach_get("vector", uv)
    corners = np.repeat(faces, 4)
    turned = uv.reshape(-1, 2)[corners] @ np.linalg.matrix_power(np.array([[0, 1], [-1, 0]]), quarters)
    uv.reshape(-1, 2)[corners] = turned + 5
    layer.foreach_set("vector", uv)


@pytest.mark.parametrize(("quarters", "jumps"), [(0, 0), (1, 8), (2, 8), (3, 8)])
def test_seams_and_islands_of_a_grid(scene, addon, quarters, jumps):
    """Half of a square is moved on the map and turned. U jumps along the middle's eight edges if it was turned."""
    mesh = grid(8).data
    middle = np.array([polygon.center.x for polygon in mesh.polygons])
    turn_uv(mesh, middle < 0, quarters)
    seams = addon.seams.Seams(mesh)
    assert np.count_nonzero(~seams.joined) == 8
    assert np.count_nonzero(seams.turned) == jumps
    assert seams.island_count() == 2
    for polygon in list(mesh.polygons)[::3]:
        polygon.flip()
    flipped = addon.seams.Seams(mesh)
    assert np.count_nonzero(flipped.turned) == jumps and flipped.island_count() == 2


@pytest.mark.night("test_seams_and_islands_of_a_grid")
def test_a_million_faces(scene, addon):
    mesh = grid(1000).data
    faces = np.arange(1_000_000) % 1000 < 500
    turn_uv(mesh, faces, 1)
    seams = addon.seams.Seams(mesh)
    assert seams.turned.any() and seams.island_count() == 2
