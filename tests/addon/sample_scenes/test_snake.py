# SPDX-License-Identifier: GPL-3.0-or-later
"""The sample snake's mesh can carry a grating, and its stage can be saved from the command line."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
from sample_scenes import demo, wall  # noqa: E402
from sample_scenes.demo import section  # noqa: E402
from sample_scenes.snake import (  # noqa: E402
    POSE_M,
    RADIUS_M,
    bspline,
    build_snake,
    half_sizes,
    make_spine,
    scale_relief,
)
from sample_scenes.stage import build_stage, clean_scene  # noqa: E402

ROOT = Path(__file__).parents[3]


def read(collection, name: str, width: int, dtype=np.float32) -> np.ndarray:
    values = np.empty(len(collection) * width, dtype)
    collection.foreach_get(name, values)
    return values.reshape(-1, width)


@pytest.fixture(scope="module")
def snake():
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    obj = build_snake()
    obj.data.calc_tangents(uvmap="UVMap")
    return obj


@pytest.fixture(scope="module")
def spine():
    return make_spine(1200)


def test_size(snake):
    # The thesis's snake has 11,696 vertices.
    assert 11_000 <= len(snake.data.vertices) <= 250_000
    assert all(scale == 1 for scale in snake.scale)


def test_mesh_is_valid_smooth_and_all_quads(snake):
    mesh = snake.data
    assert np.isfinite(read(mesh.vertices, "co", 3)).all()
    assert np.isfinite(read(mesh.corner_normals, "vector", 3)).all()
    assert (read(mesh.polygons, "loop_start", 1, np.int32)[:, 0] == np.arange(0, len(mesh.loops), 4)).all()
    assert all(polygon.use_smooth for polygon in mesh.polygons)
    assert not mesh.copy().validate(), "Blender had to repair the mesh"


def test_lies_on_the_floor(snake):
    height = read(snake.data.vertices, "co", 3)[:, 2]
    # float32 rounds coordinates of 0.3 m to 3e-8 m; the belly's highest scale points touch z = 0.
    assert -1e-6 <= height.min() < 1e-4


def test_uv_runs_from_head_to_tail_and_once_round(snake):
    uv = read(snake.data.uv_layers["UVMap"].uv, "vector", 2)
    pose = bspline(POSE_M, np.linspace(0, 1, 4001))
    length = np.linalg.norm(np.diff(pose, axis=0), axis=1).sum()
    # U is in units of the largest girth, so texels are about square; the tips are left open 1e-5 m early.
    assert uv[:, 0].min() == pytest.approx(0, abs=1e-3)
    assert uv[:, 0].max() == pytest.approx(length / (2 * np.pi * RADIUS_M), rel=1e-3)
    assert (uv[:, 1].min(), uv[:, 1].max()) == (0, 1)
    # No face straddles the seam.
    span = np.ptp(uv.reshape(-1, 4, 2), axis=1)
    assert span[:, 1].max() < 0.02


def test_frame_is_right_handed_with_the_tangent_towards_the_tail(snake, spine):
    mesh = snake.data
    assert (read(mesh.loops, "bitangent_sign", 1) == 1).all()
    corner = read(mesh.vertices, "co", 3)[read(mesh.loops, "vertex_index", 1, np.int32)[:, 0]]
    uv = read(mesh.uv_layers["UVMap"].uv, "vector", 2)
    tangent, normal = read(mesh.loops, "tangent", 3), read(mesh.corner_normals, "vector", 3)
    at = uv[:, 0] * 2 * np.pi * RADIUS_M
    along = np.stack([np.interp(at, spine.s, spine.tangent[:, k]) for k in range(3)], axis=1)
    axis = np.stack([np.interp(at, spine.s, spine.centre[:, k]) for k in range(3)], axis=1)
    # The steep rims of scales (1 corner in 20) and the blunt tips turn away; all other corners follow the body.
    assert np.mean((tangent * along).sum(1) > 0.9) > 0.94
    assert np.median((tangent * along).sum(1)) > 0.98
    assert np.mean((normal * (corner - axis)).sum(1) > 0) > 0.99
    # B = N x T points towards larger V: on the back (V = 0.5) that is the side up x T.
    back = np.abs(uv[:, 1] - 0.5) < 0.05
    side = np.cross((0.0, 0.0, 1.0), along[back])
    assert np.mean((np.cross(normal, tangent)[back] * side).sum(1) > 0.8) > 0.94


def test_body_does_not_cut_itself(spine):
    radius = np.maximum(spine.half_width, spine.half_height)
    distance = np.linalg.norm(spine.centre[:, None] - spine.centre[None], axis=-1)
    # Points nearer than a tight half-turn along the body are neighbours; the bend, checked below, separates them.
    apart = np.abs(spine.s[:, None] - spine.s[None]) > np.pi * 1.7 * RADIUS_M
    assert (distance - radius[:, None] - radius)[apart].min() > 0

    t = np.linspace(0, 1, 4001)
    pose = bspline(POSE_M, t)
    s = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(pose, axis=0), axis=1))])
    curvature = np.linalg.norm(np.gradient(np.gradient(pose, s, axis=0), s, axis=0), axis=1)[3:-3]
    half_width = half_sizes(s, s[-1])[0][3:-3]
    # The inside of a bend folds where curvature * half width reaches 1.
    assert (curvature * half_width).max() < 0.8


def test_bspline_interpolates_its_ends_and_keeps_a_straight_line():
    points = np.outer(np.arange(6.0), (1.0, 2.0))
    t = np.linspace(0, 1, 11)
    np.testing.assert_allclose(bspline(points, t), np.outer(5 * t, (1.0, 2.0)), atol=1e-12)


def test_scale_rows_are_staggered_and_lean_by_some_degrees():
    step = 0.01
    along, across = np.meshgrid(np.arange(0, 8, step), np.arange(-3, 3, step), indexing="ij")
    relief = scale_relief(along, across)
    assert relief.max() == 0
    slope = np.degrees(np.arctan(np.abs(np.gradient(relief, step, axis=0))))
    assert 3 < np.median(slope) < 15
    # Each scale has one crest; crests of odd rows lie about half a scale further.
    crest = [along[relief[:, k].argmax(), k] % 1 for k in (300, 400)]
    assert abs((crest[1] - crest[0]) % 1 - 0.5) < 0.35


def test_clean_scene_and_stage():
    bpy.ops.wm.read_homefile(use_factory_startup=True)  # keeps extensions
    clean_scene()
    scene = bpy.context.scene
    assert not scene.objects
    build_snake(rings=200, segments=24)
    build_stage(scene, sun_azimuth_deg=90, sun_elevation_deg=30)
    suns = [obj for obj in scene.objects if obj.type == "LIGHT"]
    assert [sun.data.type for sun in suns] == ["SUN"]
    bpy.context.view_layer.update()
    # A lamp shines along its -Z, so its +Z points to the sun: azimuth 90 is +Y, elevation 30 gives z = 1/2.
    np.testing.assert_allclose(suns[0].matrix_world.col[2][:3], (0, np.sqrt(3) / 2, 0.5), atol=1e-6)
    assert scene.camera and (scene.render.resolution_x, scene.render.resolution_y) == (960, 540)


def test_the_sky_has_its_sun_where_the_lamp_would_be():
    clean_scene()
    scene = bpy.context.scene
    build_stage(scene, sun_azimuth_deg=30, sun_elevation_deg=40, sky=True)
    assert not [obj for obj in scene.objects if obj.type == "LIGHT"]
    (sky,) = [node for node in scene.world.node_tree.nodes if node.type == "TEX_SKY"]
    # Clockwise from +Y: azimuth 30 is 60 degrees from there.
    assert np.degrees([sky.sun_rotation, sky.sun_elevation]) == pytest.approx([60, 40])


@pytest.mark.night("test_the_scene_of_a_wall_has_what_the_demo_names")
def test_command_line_writes_a_blend(tmp_path):
    output = tmp_path / "snake.blend"
    subprocess.run(
        [sys.executable, "-m", "sample_scenes.stage", "--output", output, "--sun-azimuth-deg", "52"],
        cwd=ROOT,
        env=os.environ,
        check=True,
        capture_output=True,
    )
    bpy.ops.wm.open_mainfile(filepath=str(output))
    assert {"Snake", "Ground", "Sun", "Camera"} <= set(bpy.data.objects.keys())


def test_the_scene_of_a_wall_has_what_the_demo_names(tmp_path):
    wall.main(["--output", str(tmp_path / "wall.blend")])
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "wall.blend"))
    assert {"Carrier", "Wall", "Table", "Spot", "Camera"} <= set(bpy.data.objects.keys())
    assert bpy.data.objects["Carrier"].data.uv_layers


def test_the_demo_takes_the_scans_that_are_there(tmp_path, capsys):
    (tmp_path / "xenopeltis_65um.png").touch()
    sample, scan = demo.subjects(tmp_path / "out", scans=tmp_path)
    assert sample.file == "sample:elaphe"
    assert (scan.file, scan.folder) == (str(tmp_path / "xenopeltis_65um.png"), tmp_path / "out" / "xenopeltis_65um")
    assert scan.options == ("--size-um", "65", "--height-nm", "818.69")
    assert (scan.species, scan.pictures) == ("XENOPELTIS", ("snake",))
    assert "no elaphe_65um.png" in capsys.readouterr().out


@pytest.mark.parametrize("count", [3, 5])
def test_the_report_shows_every_picture(tmp_path, count):
    info = {"cols": 4, "rows": 4, "pixel_size_m": (1e-9, 1e-9), "height_range_m": 1e-7, "height_rms_m": 1e-8}
    info |= {"periods_m": [1e-6], "period_angles_deg": [0.0]}
    error = {"mean": 0.1, "p95": 0.2, "p99": 0.3, "max": 0.4, "pairs": 9, "relative_dy": 0.01}
    bake = {"delta_e": error, "coherence_um": 9.0, "tiles": 3, "tile": (4, 4), "blender_bytes": 1, "seconds": 1.0}
    pictures = {f"Picture {k}": tmp_path / f"{k}.png" for k in range(count)}
    result = {"title": "A", "info": info, "bake": bake | {"check_seconds": 1.0}, "folder": tmp_path}
    text = "\n".join(section(tmp_path, result | {"pictures": pictures}))
    assert [line.rpartition("(")[2] for line in text.split("\n") if line.startswith("![")] == [
        "brdf_map.png)", *(f"{k}.png)" for k in range(count))
    ]  # fmt: skip


@pytest.mark.night("test_the_scene_of_a_wall_has_what_the_demo_names")
@pytest.mark.parametrize("script", ["stage.py", "views.py", "wall.py", "animal.py", "products.py", "discs.py"])
def test_the_scripts_of_the_demo_find_the_project_from_any_folder(script, tmp_path):
    """`blender --python FILE` puts neither the project nor the working folder on its path."""
    command = [sys.executable, "-P", ROOT / "sample_scenes" / script, "--help"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "--output" in done.stdout
