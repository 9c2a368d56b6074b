# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays through a 3D view: a view with a camera's matrices has the camera's rays."""

from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from tests.addon.conftest import add_camera

AT = np.array([(0.5, 0.5), (0.1, 0.2), (0.9, 0.7)])


def view_like(camera):
    """What a 3D view tells of itself where it looks as a camera does, at 160 x 90 pixels."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return SimpleNamespace(
        view_matrix=camera.matrix_world.inverted(), is_perspective=camera.data.type == "PERSP",
        window_matrix=camera.calc_matrix_camera(depsgraph, x=160, y=90),
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
def test_a_view_has_the_rays_of_a_camera_with_its_matrices(addon, scene, kind):
    camera = add_camera(scene, (1, 2, 3))
    camera.rotation_euler, camera.data.type = (0.3, 0.4, 0.5), kind
    camera.data.shift_x = 0.1
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 160, 90, 100
    bpy.context.view_layer.update()
    start, along = addon.seen_surfaces.Pixels(scene, camera).rays(AT)
    other, also = addon.seen_surfaces.ViewPixels(view_like(camera), (160, 90)).rays(AT)
    # Blender's matrices are in single precision; an orthographic view starts a kilometre further back on the same ray.
    np.testing.assert_allclose(also, along, atol=1e-5)
    away = ((start - other) * along).sum(axis=1, keepdims=True)
    np.testing.assert_allclose(other + away * along, start, atol=1e-3 if kind == "ORTHO" else 1e-5)
    scene.camera = None


def test_points_in_a_frame(addon, scene):
    """A camera of 50 mm with a sensor of 36 mm sees 0.36 to each side at a distance of 1."""
    camera = add_camera(scene, (0, 0, 10))
    scene.render.resolution_x, scene.render.resolution_y = 160, 90
    bpy.context.view_layer.update()
    points = np.array([(0, 0, 0), (3.5, 0, 0), (3.7, 0, 0), (0, 0, 20)], float)
    assert addon.seen_surfaces.Pixels(scene, camera).in_frame(points).tolist() == [True, True, False, False]
    camera.data.type, camera.data.ortho_scale = "ORTHO", 7.2
    assert addon.seen_surfaces.Pixels(scene, camera).in_frame(points).tolist() == [True, True, False, False]
    scene.camera = None
