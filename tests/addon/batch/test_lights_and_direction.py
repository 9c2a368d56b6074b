# SPDX-License-Identifier: GPL-3.0-or-later
"""The verbs `lights` and `direction`: what they change, what they save, and their one-line errors."""

import bpy
import pytest

from .test_commands import fault


@pytest.fixture
def assigned(scene, grating):
    """A plane that shows the active grating, and another grating that nothing shows."""
    assert bpy.ops.grating.assign() == {"FINISHED"}
    other = scene.natural_gratings.items.add()
    other.name = "other"
    return scene.natural_gratings.items[0]


@pytest.fixture
def run(addon, tmp_path):
    def execute(*words) -> int:
        return addon.commands.execute([*words, "--save", str(tmp_path / "plane.blend")])

    return execute


def nodes(group) -> set[str]:
    """The kinds of nodes in a group and its groups."""
    found = {node.bl_idname for node in group.nodes}
    for node in group.nodes:
        if getattr(node, "node_tree", None) is not None:
            found |= nodes(node.node_tree)
    return found


def test_lights_and_shadows_are_chosen_and_saved(addon, scene, assigned, run, tmp_path, capfd):
    assert run("lights", "lamps", "--object", "Plane", "--shadows", "off") == 0
    assert "waves: Lamps Only, shadows off" in capfd.readouterr().out
    assert assigned.lights == "LAMPS" and not assigned.shadows
    assert assigned.group["ng_lights"] == "LAMPS"
    assert "ShaderNodeRaycast" not in nodes(assigned.group)
    assert run("lights", "--shadows", "on", "--grating", "waves") == 0
    assert assigned.lights == "LAMPS" and assigned.shadows
    assert ("ShaderNodeRaycast" in nodes(assigned.group)) == addon.compat.HAS_RAYCAST
    assert (tmp_path / "plane.blend").is_file()
    assert scene.natural_gratings.items["other"].lights == "REST"


def test_a_lamp_is_left_out_and_kept_in(addon, scene, assigned, run, capfd):
    sun = bpy.data.objects["Sun"]
    for option, counts in (("--leave-out", False), ("--leave-out", False), ("--keep-in", True), ("--keep-in", True)):
        assert run("lights", option, "Sun") == 0
        assert (sun in addon.follow.counted_lamps(scene)) == counts
    told = capfd.readouterr().out
    assert told.count("already") == 2


@pytest.mark.parametrize(
    ("words", "kind", "told"),
    [
        (["uv-map", "--uv-map", "UVMap"], "UV_MAP", "the UV map UVMap"),
        (["radial"], "RADIAL", "away from the object's Z axis"),
        (["axis", "--axis", "x", "--angle", "grating_angle"], "AXIS", "the object's X axis"),
        (["stored"], "STORED", "what is stored on the mesh"),
    ],
)
def test_a_direction_is_chosen(scene, assigned, run, capfd, words, kind, told):
    assert run("direction", *words, "--object", "Plane") == 0
    assert f"waves: its direction is from {told}" in capfd.readouterr().out
    source = assigned.frame_source()
    assert source.kind == kind
    assert source.angle == ("grating_angle" if "--angle" in words else "")
    assert source.axis == ("X" if "--axis" in words else "Z")
    assert scene.natural_gratings.items["other"].frame_source().kind == "STORED"


def test_a_direction_map_is_chosen(addon, scene, assigned, run):
    assert run("direction-map", "--object", "Plane", "--size", "16", "--keep-source") == 0
    (picture,) = [image.name for image in bpy.data.images if addon.direction_source.is_frame_map(image)]
    assert run("direction", "direction-map", "--map", picture) == 0
    assert assigned.frame_source().frame_map.name == picture


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["lights"], "nothing to change is given"),
        (["lights", "all", "--grating", "none"], "--grating none: no such grating; there are waves, other"),
        (["lights", "all", "--grating", "waves", "--object", "Plane"], "--object is given too"),
        (["lights", "all", "--object", "Sun"], "Sun: no mesh is selected"),
        (["lights", "--leave-out", "Moon"], "Moon: no lamp of the scene; there are Sun"),
        (["lights", "moon"], "invalid choice"),
        (["direction", "uv-map"], "no UV map is named for its direction"),
        (["direction", "uv-map", "--uv-map", "None"], "None"),
        (["direction", "axis", "--uv-map", "UVMap"], "--uv-map: axis has no use for it"),
        (["direction", "stored", "--axis", "x"], "leave it out, or choose radial or axis"),
        (["direction", "direction-map", "--map", "No"], "--map No: no such picture in the file"),
        (["direction", "direction-map"], "no picture is no direction map"),
    ],
)
def test_faults_are_one_line_and_change_nothing(addon, scene, assigned, tmp_path, capfd, words, told):
    before = (assigned.lights, assigned.shadows, assigned.frame_source())
    assert told in fault(capfd, addon, *words, "--save", tmp_path / "plane.blend")
    assert (assigned.lights, assigned.shadows, assigned.frame_source()) == before
    assert list(tmp_path.iterdir()) == []


def test_a_mesh_without_a_grating_is_named(addon, scene, assigned, tmp_path, capfd):
    bpy.ops.mesh.primitive_cube_add()
    line = fault(capfd, addon, "lights", "all", "--object", "Plane", "--object", "Cube", "--save", tmp_path / "a.blend")
    assert "Cube: no grating of the scene is on it; use `assign` first" in line
