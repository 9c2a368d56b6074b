# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo: its scan, its report, its scene of a wall; and a sky."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
from sample_scenes import demo, wall  # noqa: E402
from sample_scenes.demo import section  # noqa: E402
from sample_scenes.stage import clean_scene, light_by_sky  # noqa: E402

ROOT = Path(__file__).parents[3]


def test_the_sky_has_its_sun_where_the_lamp_would_be():
    clean_scene()
    scene = bpy.context.scene
    light_by_sky(scene, azimuth_deg=30, elevation_deg=40)
    assert not scene.objects
    (sky,) = [node for node in scene.world.node_tree.nodes if node.type == "TEX_SKY"]
    # Clockwise from +Y: azimuth 30 is 60 degrees from there.
    assert np.degrees([sky.sun_rotation, sky.sun_elevation]) == pytest.approx([60, 40])


def test_the_scene_of_a_wall_has_what_the_demo_names(tmp_path):
    bpy.ops.wm.read_homefile(use_factory_startup=True)  # keeps extensions
    wall.main(["--output", str(tmp_path / "wall.blend")])
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "wall.blend"))
    assert {"Carrier", "Wall", "Table", "Spot", "Camera"} <= set(bpy.data.objects.keys())
    assert bpy.data.objects["Carrier"].data.uv_layers


def test_the_demo_takes_the_scan_that_is_there(tmp_path):
    assert demo.scan_or_sample("xenopeltis", tmp_path) == ["sample:xenopeltis"]
    scan = tmp_path / "xenopeltis_65um.png"
    scan.touch()
    assert demo.scan_or_sample("xenopeltis", tmp_path) == [str(scan), "--size-um", "65", "--height-nm", "818.69"]
    assert demo.scan_or_sample("cd", tmp_path) == ["sample:cd"]


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
@pytest.mark.parametrize("script", ["wall.py", "animal.py", "products.py", "discs.py"])
def test_the_scripts_of_the_demo_find_the_project_from_any_folder(script, tmp_path):
    """`blender --python FILE` puts neither the project nor the working folder on its path."""
    command = [sys.executable, "-P", ROOT / "sample_scenes" / script, "--help"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "--output" in done.stdout
