# SPDX-License-Identifier: GPL-3.0-or-later
"""The integrals and scenes of `./dev bench lights`, with which renders are compared."""

import numpy as np
import pytest

from laboratory.benchmarks import lights
from laboratory.benchmarks import lights_scenes as scenes
from laboratory.benchmarks.hemisphere import Surface, directional_albedo, hemisphere
from laboratory.benchmarks.lights_scenes import Worlds


@pytest.fixture
def studio(stage, skin):
    """The benchmark's studio with the stage's add-on and a bake of short coherence."""
    return Worlds(stage.addon, stage.folder, 16, skin[0])


def test_the_hemisphere_has_two_pi():
    """The rings' midpoint rule is off by (step)^2 / 24 times their share, and the grid by less."""
    directions, solid_angles = hemisphere(0.02)
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, rtol=1e-12)
    assert solid_angles.sum() == pytest.approx(2 * np.pi, rel=1e-3)
    np.testing.assert_allclose(directions.T @ (solid_angles * directions[:, 2]), (0, 0, 2 * np.pi / 3), atol=1e-3)


@pytest.mark.parametrize("degrees", [0, 40, 80])
def test_a_white_world_shows_the_directional_albedo(skin, degrees):
    """Compared with sums over another grid, which clamp scattered light and mirror image to the gamut together. One may
    then make up for what the other lacks: 0.4 % of the red on the blazed sample at the normal, and less here."""
    _, table = skin
    theta = np.radians(degrees)
    surface, wr = Surface.of(table), np.array((np.sin(theta), 0, np.cos(theta)))
    found = surface.scattered(wr).sum(axis=0) + surface.mirrored(wr)[1].sum(axis=0)
    np.testing.assert_allclose(found, directional_albedo(table, theta), rtol=5e-3)


def test_points_have_places_frames_and_views(studio):
    studio.build("sphere")
    points = scenes.free_points(studio, 16, 40)
    assert len(points.positions) == len(points.pixels[0]) == 40
    # A facet of the 128 x 64 sphere lies up to 1 - cos(pi / 128) inside it.
    np.testing.assert_allclose(np.linalg.norm(points.positions, axis=1), scenes.RADIUS_M, rtol=2e-3)
    normals = points.frames[:, 2]
    np.testing.assert_allclose(normals, points.positions / scenes.RADIUS_M, atol=0.03)
    squares = points.frames @ points.frames.transpose(0, 2, 1)
    np.testing.assert_allclose(squares, np.broadcast_to(np.eye(3), squares.shape), atol=1e-5)
    to_camera = np.array(studio.scene.camera.location) - points.positions
    to_camera /= np.linalg.norm(to_camera, axis=1, keepdims=True)
    np.testing.assert_allclose(np.einsum("nji,nj->ni", points.frames, points.views), to_camera, atol=1e-4)


def test_what_is_hidden_is_taken_last(studio):
    """On a plane before a wall, the points away from the wall come first."""
    import bpy

    studio.build("sphere")
    mesh = bpy.data.meshes.new("corner")
    corners = [(-1, -1, 0), (1, -1, 0), (1, 0.1, 0), (-1, 0.1, 0), (1, 0.1, 0.3), (-1, 0.1, 0.3)]
    mesh.from_pydata(corners, [], [(0, 1, 2, 3), (3, 2, 4, 5)])
    mesh.uv_layers.new(name="UVMap")
    mesh.materials.append(None)
    bpy.data.objects.remove(studio.mesh)
    studio.mesh = bpy.data.objects.new("corner", mesh)
    studio.scene.collection.objects.link(studio.mesh)
    bpy.context.view_layer.update()
    away = scenes.free_points(studio, 16, 1000).positions
    floor = away[away[:, 2] < 1e-3]
    assert floor[:10, 1].max() < floor[-10:, 1].min()


def test_faces_that_no_point_is_on_are_black(studio):
    """They take no time, and where the mesh reflects itself it is dark, as in the integrals."""
    studio.build("sphere")
    points = scenes.free_points(studio, 16, 5)
    material, _ = studio.material(studio.bake, "LAMPS")
    studio.mesh.material_slots[0].material = material
    faces = studio.mesh.data.polygons
    lit = [face for face in faces if face.material_index == 0]
    assert len(lit) == 5
    middles = np.array([face.center for face in lit])
    apart = np.linalg.norm(points.positions[:, None] - middles, axis=-1).min(axis=1)
    assert apart.max() < 2 * np.pi * scenes.RADIUS_M / 64  # half a face's diagonal is less


def test_equal_pictures_do_not_differ():
    expected = np.random.default_rng(1).random((50, 3))
    row = lights.compared(np.stack([expected, expected]), expected)
    assert row["de_median"] == row["de_p95"] == row["noise"] == 0 and row["light"] == pytest.approx(1)
    brighter = lights.compared(np.stack([expected * 1.1] * 2), expected)
    assert brighter["light"] == pytest.approx(1.1) and brighter["de_median"] > 0.5


@pytest.mark.night("test_a_white_world_shows_the_directional_albedo")
def test_an_overcast_sphere_is_its_integral(studio, skin):
    """Render and integral share only the table. A thousand samples at forty points have a noise of 0.5 %."""
    studio.build("sphere")
    points = scenes.free_points(studio, 16, 40)
    sky = {"overcast sky": studio.light_by("overcast sky")}
    scattered, mirrored = lights.integrals(Surface.of(skin[1]), points, sky)["overcast sky"]
    rows = lights.pictures(studio, skin[0], world="overcast sky", size=(16, 1024))
    for _, part, picture in rows:
        row = lights.compared(picture[:, *points.pixels], scattered + mirrored if part == "whole" else scattered)
        assert row["light"] == pytest.approx(1, abs=0.03), (part, row)
        assert row["de_median"] < 2, (part, row)
