# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene that leaves the region for which its grating was baked: noticed at assign, at save and before a render."""

import json
import math
import subprocess
import sys

import bpy
import pytest

from devtools import ROOT


@pytest.fixture(scope="session")
def narrow(scan, tmp_path_factory):
    """A bake of the scan for what the `watched` plane shows: u from 0.5 to 0.8, v from -0.2 to 0.2, w from 1.7 on."""
    folder = tmp_path_factory.mktemp("narrow")
    needs = folder / "needs.json"
    needs.write_text(json.dumps({"format": 1, "u": [0.5, 0.8], "v": [-0.2, 0.2], "w": [1.7, 2.0]}))
    command = [sys.executable, "-m", "precompute", "bake", scan, "--size-um", "4", "--height-nm", "100"]
    command += ["--delta-e", "6", "--needs", needs, "-o", folder]
    subprocess.run([str(part) for part in command], cwd=ROOT, check=True, capture_output=True)
    return folder / "waves.exr"


@pytest.fixture
def narrowed(scene, watched, narrow, addon):
    """The watched plane with the narrow bake."""
    grating = scene.natural_gratings.active()
    grating.bake_path = str(narrow)
    addon.making_materials.refresh_group(grating)
    yield watched
    addon.bakes.note_outside(scene, [])


def turn_camera(scene):
    """Let the camera look at the plane from 20 degrees towards the sun."""
    angle = math.radians(20)
    scene.camera.location = (10 * math.sin(angle), 0, 10 * math.cos(angle))
    scene.camera.rotation_euler = (0, angle, 0)
    bpy.context.view_layer.update()


@pytest.mark.night("tests/addon/workflow/test_foreign_paths.py")
def test_the_region_is_noted_with_the_bake(scene, watched, narrow, addon):
    grating = scene.natural_gratings.active()

    def noted():
        return addon.bakes.noted_region(addon.response.response_in(grating.group).group)

    assert noted() is None and not addon.bakes.has_regions()
    wide, grating.bake_path = grating.bake_path, str(narrow)
    addon.making_materials.refresh_group(grating)
    held = noted()
    # Whole texels around the request; a texel of this coarse bake is under 0.1.
    assert 0.4 < held.region.u[0] <= 0.5 and 0.8 <= held.region.u[1] < 0.9 and held.w == (1.7, 2.0)
    grating.bake_path = wide
    addon.making_materials.refresh_group(grating)
    assert noted() is None and not addon.bakes.has_regions()


def test_a_camera_that_was_turned_is_noticed(scene, narrowed, addon):
    assert addon.finding_bakes.notice_outside(scene) == [] == addon.bakes.noticed_outside(scene)
    turn_camera(scene)
    (line,) = addon.finding_bakes.notice_outside(scene)
    assert line.startswith("Plane: 100% of its light is black, because its grating was baked for another camera or ")
    assert line.endswith("press Bake for This Scene again")
    # sin 40 + sin 20 is 0.98; the plane is 2 m wide, 10 m away.
    reached = float(line.split("u up to ")[1].split(",")[0])
    assert math.sin(math.radians(40)) + math.sin(math.radians(20)) < reached < 1.1
    assert addon.bakes.noticed_outside(scene) == [line]


def test_light_from_everywhere_is_noticed(scene, narrowed, addon):
    bpy.ops.grating.lights(lights="REST")
    (line,) = addon.finding_bakes.notice_outside(scene)
    assert "u down to -1" in line and "w down to 0.9" in line


def test_it_is_told_at_assign_at_save_and_before_a_render(scene, narrowed, tmp_path, capfd):
    def told(action):
        capfd.readouterr()
        assert action() == {"FINISHED"}
        return "".join(capfd.readouterr()).count("its grating was baked for another camera")

    def save():
        return bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"), copy=True)

    def render():
        return bpy.ops.render.render()

    scene.render.engine, scene.cycles.samples = "CYCLES", 1
    assert [told(action) for action in (bpy.ops.grating.assign, save, render)] == [0, 0, 0]
    turn_camera(scene)
    assert [told(action) for action in (bpy.ops.grating.assign, save, render)] == [1, 1, 1]


def test_a_scene_without_a_camera_has_nothing_to_notice(scene, narrowed, addon):
    turn_camera(scene)
    scene.camera = None
    assert addon.finding_bakes.notice_outside(scene) == []


@pytest.mark.parametrize("mode", ["EDIT", "SCULPT", "WEIGHT_PAINT"])
def test_a_scene_is_saved_in_any_mode(scene, narrowed, addon, tmp_path, capfd, mode):
    """Where Blender lets the faces be read, the add-on warns about them; in Edit Mode it gives no warning."""
    turn_camera(scene)
    bpy.ops.object.mode_set(mode=mode)
    try:
        assert bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"), copy=True) == {"FINISHED"}
        assert "Traceback" not in "".join(capfd.readouterr())
        assert len(addon.finding_bakes.notice_outside(scene)) == (mode != "EDIT")
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
