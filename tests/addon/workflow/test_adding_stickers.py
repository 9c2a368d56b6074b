# SPDX-License-Identifier: GPL-3.0-or-later
"""Add Sticker: where a sticker lies, that it follows the surface, its material, and what it refuses."""

from math import radians

import bpy
import numpy as np
import pytest
from PIL import Image

# As in adding_things.py, of a width of 1. A sticker's edges stand out by up to twice as much in the picture.
GAP = 0.002


@pytest.fixture
def can(scene, grating):
    """A can with a radius of 1 and a height of 4 before a camera that looks along Y. It is active."""
    bpy.data.objects.remove(bpy.data.objects["Plane"])
    bpy.ops.mesh.primitive_cylinder_add(radius=1, depth=4, vertices=256)
    can = bpy.context.active_object
    can.data.materials.append(bpy.data.materials.new("Tin"))
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0, -20, 0), (radians(90), 0, 0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.context.view_layer.update()
    return can


def points_of(thing):
    """The points of an evaluated mesh in world space."""
    seen = thing.evaluated_get(bpy.context.evaluated_depsgraph_get())
    points = np.empty((len(seen.data.vertices), 3), np.float32)
    seen.data.vertices.foreach_get("co", points.ravel())
    return points @ np.array(seen.matrix_world)[:3, :3].T + np.array(seen.matrix_world.translation)


def lies_on(points):
    """Whether points lie above the can, by a sticker's gap at most. The can's facets and the modifier's normals take up
    to half of the gap."""
    radius = np.hypot(points[:, 0], points[:, 1])
    return 1 + GAP / 2 < radius.min() and radius.max() < 1 + GAP


def picture(tmp_path, size):
    path = tmp_path / "logo.png"
    Image.new("RGB", size, (200, 40, 40)).save(path)
    return str(path)


def test_it_lies_on_the_surface_that_the_camera_sees(can):
    assert bpy.ops.grating.add_sticker() == {"FINISHED"}
    sticker = bpy.context.active_object
    points = points_of(sticker)
    # Half of the can's width of 2, and square.
    assert np.ptp(points[:, 0]) == pytest.approx(1.0, abs=2 * GAP)
    assert np.ptp(points[:, 2]) == pytest.approx(1.0, abs=2 * GAP)
    assert lies_on(points)
    assert points[:, 1].max() < 0
    assert sticker.parent == can and can.select_get() is False
    # U runs to the right in the picture, so the picture on it is not mirrored.
    uv = np.empty((len(sticker.data.loops), 2), np.float32)
    sticker.data.uv_layers[0].uv.foreach_get("vector", uv.ravel())
    right = {loop.vertex_index for loop, (u, _) in zip(sticker.data.loops, uv, strict=True) if u == 1}
    assert all(points[index, 0] > 0.49 for index in right)


def test_it_follows_the_surface_when_it_is_moved(can):
    bpy.ops.grating.add_sticker()
    sticker = bpy.context.active_object
    sticker.location.z += 0.7
    can.location.x = 3
    bpy.context.view_layer.update()
    points = points_of(sticker)
    assert lies_on(points - (3, 0, 0))
    assert points[:, 2].mean() == pytest.approx(0.7, abs=1e-3)


def test_the_mesh_keeps_its_materials(can, scene):
    bpy.ops.grating.add_sticker()
    assert [slot.material.name for slot in can.material_slots] == ["Tin"]
    sticker = bpy.context.active_object
    assert [slot.material for slot in sticker.material_slots] == [scene.natural_gratings.active().material]


def test_a_picture_gives_it_its_shape_and_a_pattern_of_its_own(can, scene, tmp_path):
    bpy.ops.grating.add_sticker()
    first = bpy.context.active_object
    bpy.context.view_layer.objects.active = can
    assert bpy.ops.grating.add_sticker(filepath=picture(tmp_path, (64, 32)), rotation=radians(90)) == {"FINISHED"}
    second = bpy.context.active_object
    points = points_of(second)
    # Its width along Z is half of the can's width, its height around the can half of that.
    assert np.ptp(points[:, 2]) == pytest.approx(1.0, abs=2 * GAP)
    assert np.ptp(points[:, 0]) == pytest.approx(0.5, abs=2 * GAP)
    materials = [thing.material_slots[0].material for thing in (first, second)]
    assert materials[0] != materials[1]
    patterns = [
        [node.node_tree.name for node in m.node_tree.nodes if node.type == "GROUP" and "Picture" in node.node_tree.name]
        for m in materials
    ]
    assert not patterns[0] and patterns[1]


def test_without_a_grating_it_is_a_security_hologram(can, scene, tmp_path):
    scene.natural_gratings.items.clear()
    scene.natural_gratings.active_index = 0
    assert bpy.ops.grating.add_sticker(filepath=picture(tmp_path, (8, 8))) == {"FINISHED"}
    assert scene.natural_gratings.active().name == "Security Hologram"


@pytest.mark.parametrize(
    "spoil", [lambda can: setattr(can, "location", (0, -40, 0)), lambda can: can.data.clear_geometry()]
)
def test_it_refuses_what_it_cannot_cover_and_leaves_nothing(can, spoil, tmp_path):
    spoil(can)
    bpy.context.view_layer.update()
    before = [len(each) for each in (bpy.data.objects, bpy.data.meshes, bpy.data.materials, bpy.data.images)]
    with pytest.raises(RuntimeError, match="the view does not show it"):
        bpy.ops.grating.add_sticker(filepath=picture(tmp_path, (8, 8)))
    assert [len(each) for each in (bpy.data.objects, bpy.data.meshes, bpy.data.materials, bpy.data.images)] == before


@pytest.mark.parametrize("path", ["/nowhere.png", __file__])
def test_a_bad_picture_is_refused_in_a_line(can, path):
    before = [len(each) for each in (bpy.data.objects, bpy.data.meshes, bpy.data.images)]
    with pytest.raises(RuntimeError, match="no such file|not a picture"):
        bpy.ops.grating.add_sticker(filepath=path)
    assert [len(each) for each in (bpy.data.objects, bpy.data.meshes, bpy.data.images)] == before
    assert bpy.context.active_object == can


def test_in_batch(can, scene, addon, tmp_path, capsys):
    blend = tmp_path / "can.blend"
    line = ["sticker", "--object", "Cylinder", "--size", "0.25", "--rotation", "45", "--picture"]
    assert addon.commands.execute([*line, picture(tmp_path, (8, 8)), "--save", str(blend)]) == 0
    assert "Sticker: on Cylinder" in capsys.readouterr().out
    assert blend.is_file()
    # A square of half a metre, turned by 45 degrees.
    assert np.ptp(points_of(bpy.data.objects["Sticker"])[:, 2]) == pytest.approx(0.5 * 2**0.5, abs=2 * GAP)


@pytest.mark.parametrize(
    "arguments", [["--preset", "nothing"], ["--picture", "/nowhere.png"], ["--size", "0"], ["--object", "Sun"]]
)
def test_bad_arguments_in_batch_change_nothing(can, scene, addon, tmp_path, capsys, arguments):
    before = set(bpy.data.objects)
    assert addon.commands.execute(["sticker", *arguments, "--save", str(tmp_path / "a.blend")]) != 0
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert set(bpy.data.objects) == before and not (tmp_path / "a.blend").exists()
