# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders under a world, compared with integrals of the table over the hemisphere: without sources and closures."""

import shutil

import bpy
import numpy as np
import pytest

from laboratory.benchmarks.blender import colour_differences
from laboratory.benchmarks.hemisphere import Surface, directional_albedo, hemisphere, without_mirror
from precompute.colour.spaces import rgb_from_xyz
from precompute.table import atlas
from precompute.table.sample_set import path_beside
from sample_scenes.relight import paint
from sample_scenes.room import overcast

from .world_scenes import add_ball, assign, look_at_ball

PIXELS, SAMPLES = 12, 1024
LUMINANCE = np.linalg.inv(rgb_from_xyz("Rec.709"))[1]


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


def looked_up(panorama, directions):
    """Values (n, 3) of a panorama (rows, cols, 3) in directions (n, 3), like an Environment Texture with "Linear"."""
    rows, cols, _ = panorama.shape
    x = (0.5 - np.arctan2(directions[:, 1], directions[:, 0]) / (2 * np.pi)) * cols - 0.5
    y = (0.5 + np.arcsin(np.clip(directions[:, 2], -1, 1)) / np.pi) * rows - 0.5
    left, below = np.floor(x).astype(int), np.clip(np.floor(y).astype(int), 0, rows - 2)
    across, up = (x - left)[:, None], (y - below)[:, None]
    bottom, top = (
        panorama[row, left % cols] * (1 - across) + panorama[row, (left + 1) % cols] * across
        for row in (below, below + 1)
    )
    return bottom * (1 - up) + top * up


def points_of_ball(ball, camera):
    """The rows and columns (n,) of pixels that show the ball of radius 1 in the origin, and there the tangent frames
    (n, 3, 3), T, B and N in rows, and the unit vectors to the camera (n, 3) in these frames."""
    bpy.context.view_layer.update()
    side = (np.arange(PIXELS) + 0.5) / PIXELS * 2 - 1
    x, y = np.meshgrid(side, -side)
    ray = (
        np.stack([x, y, np.full_like(x, -1 / np.tan(camera.data.angle / 2))], axis=-1)
        @ np.array(camera.matrix_world.to_3x3()).T
    )
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    start = np.array(camera.location)
    along = -(ray @ start)
    beneath = along**2 - start @ start + 1
    n = start + (along - np.sqrt(np.maximum(beneath, 0)))[..., None] * ray
    seen = (beneath > 0) & (-(ray * n).sum(axis=-1) > 0.1)
    n, to_camera = n[seen], -ray[seen]
    ball.data.calc_tangents()
    loop = ball.data.loops[len(ball.data.loops) // 2]
    at = ball.data.vertices[loop.vertex_index].co
    side = np.sign(loop.tangent.x * -at.y + loop.tangent.y * at.x)  # the way in which U runs around the ball
    t = side * np.stack([-n[:, 1], n[:, 0], 0 * n[:, 0]], axis=1)
    t /= np.linalg.norm(t, axis=1, keepdims=True)
    frames = np.stack([t, np.cross(n, t), n], axis=1)
    return np.nonzero(seen), frames, np.einsum("nij,nj->ni", frames, to_camera)


@pytest.mark.night("test_a_white_world_shows_the_directional_albedo")
@pytest.mark.parametrize("part", ["whole", "scattered"])
def test_an_overcast_ball_is_its_integral(stage, skin, part):
    """Render and integral share only the table. The random order's noise is below 1 %."""
    path, table = skin
    if part == "scattered":
        path, whole, table = stage.folder / "scattered.exr", path, without_mirror(table)
        image, layout = atlas.pack(table)
        atlas.write_together({path: (image, layout)}, {"precision": str(image.dtype)})
        shutil.copyfile(path_beside(whole), path_beside(path))
    stage.filter = "GAUSSIAN", 0.01  # Cycles' box is a whole pixel at any width, and mixes in what is beside the ball
    panorama = overcast(128)
    paint(stage.scene, panorama)
    add_ball()
    look_at_ball(stage)
    assign(stage, path, "REST")
    pixels, frames, views = points_of_ball(bpy.context.object, stage.scene.camera)
    assert len(views) > 30
    surface, expected = Surface.of(table), []
    for frame, wr in zip(frames, views, strict=True):
        wi, mirrored = surface.mirrored(wr)
        scattered = looked_up(panorama, surface.directions @ frame) * surface.scattered(wr)
        expected.append(scattered.sum(axis=0) + (looked_up(panorama, wi @ frame) * mirrored).sum(axis=0))
    found, expected = stage.rgb("cycles", PIXELS, SAMPLES)[pixels], np.array(expected)
    assert (found @ LUMINANCE).sum() == pytest.approx((expected @ LUMINANCE).sum(), rel=0.03)
    assert np.median(colour_differences(found, expected)) < 2
