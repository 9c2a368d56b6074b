# SPDX-License-Identifier: GPL-3.0-or-later
"""Baking direction maps: the picture's contents, its users, and one-line errors. tests/render tests its light."""

import bpy
import numpy as np
import OpenEXR
import pytest

from tests.addon.batch.test_commands import fault
from tests.addon.conftest import reports, select


@pytest.fixture
def carrier(scene, grating):
    """The plane with the grating. Its active UV map is a second one, mirrored, that fills half of the square."""
    bpy.ops.grating.lights(lights="LAMPS")
    assert bpy.ops.grating.assign() == {"FINISHED"}
    plane = bpy.context.object
    layer = plane.data.uv_layers.new(name="Half")
    layer.active = True
    for corner in layer.uv:
        u, v = corner.vector
        corner.vector = (0.75 - u / 2, 0.25 + v / 2)
    return plane


def pixels_of(image) -> np.ndarray:
    held = np.empty(image.size[0] * image.size[1] * 4, np.float32)
    image.pixels.foreach_get(held)
    return held.reshape(image.size[1], image.size[0], 4)


def contents() -> list[str]:
    kinds = ("objects", "meshes", "materials", "scenes", "images", "node_groups")
    return [f"{kind} {one.name}" for kind in kinds for one in getattr(bpy.data, kind)]


def test_a_picture_holds_the_angle_from_its_map_s_tangent(scene, carrier, grating, addon, capfd):
    """T is x. The map's tangent is -x: half a turn, cosine -1 and sine 0. It continues beyond the island's edge."""
    before, set_up = contents(), (scene.render.engine, scene.cycles.samples)
    told = reports(lambda: bpy.ops.grating.bake_direction_map(size=64, margin=4), capfd)
    assert "Plane Half frame: the direction on Plane, 64 x 64 pixels on its UV map Half" in told
    image = bpy.data.images["Plane Half frame"]
    # Single precision through a normalisation.
    np.testing.assert_allclose(pixels_of(image)[16:48, 12:52, :2], np.broadcast_to((0, 0.5), (32, 40, 2)), atol=1e-5)
    assert sorted(contents()) == sorted([*before, "images Plane Half frame"])
    assert image.packed_file is not None and image.colorspace_settings.name == "Non-Color" and image.is_float
    assert (scene.render.engine, scene.cycles.samples) == set_up
    source = addon.group_properties.frame_of(grating.group)
    assert source == grating.frame_source() and source.frame_map == image and source.named_uv_map == "Half"


def test_rotation_is_not_baked(carrier, addon):
    """The material still has it."""
    (node,) = addon.material.diffraction_nodes(carrier.active_material)
    node.inputs["Rotation"].default_value = 1.0
    bpy.ops.grating.bake_direction_map(size=32)
    np.testing.assert_allclose(pixels_of(bpy.data.images["Plane Half frame"])[16, 16, :2], (0, 0.5), atol=1e-5)


def test_it_can_be_baked_for_others_alone(carrier, grating, tmp_path):
    path = tmp_path / "maps" / "plane.exr"
    bpy.ops.grating.bake_direction_map(size=32, filepath=str(path), read=False)
    assert grating.frame_kind == "STORED"
    with OpenEXR.File(str(path)) as file:
        held = file.channels()["RGB"].pixels
    assert held.dtype == np.float32
    np.testing.assert_allclose(held[16, 16, :2], (0, 0.5), atol=1e-5)
    assert bpy.data.images["Plane Half frame"].packed_file is not None


def test_every_slot_has_its_own_source(scene, carrier, grating, baked):
    """Two faces, two gratings: one along the UV map, one along the object's Y."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=2, y_subdivisions=1, size=2)
    mesh = bpy.context.object
    bpy.ops.grating.assign()
    second = scene.natural_gratings.items.add()
    second.name, second.bake_path = "second", str(baked)
    scene.natural_gratings.active_index = 1
    bpy.ops.grating.direction(kind="AXIS", axis="Y")
    mesh.data.materials.append(None)
    mesh.active_material_index = 1
    bpy.ops.grating.assign()
    mesh.data.polygons[1].material_index = 1
    bpy.ops.grating.bake_direction_map(size=64)
    held = pixels_of(bpy.data.images[f"{mesh.name} UVMap frame"])[32, :, :2]
    np.testing.assert_allclose(held[16], (1, 0.5), atol=1e-5)
    np.testing.assert_allclose(held[48], (0.5, 1), atol=1e-5)


def test_another_mesh_that_shows_the_grating_keeps_its_direction(carrier, grating, capfd):
    bpy.ops.mesh.primitive_plane_add()
    other = bpy.context.object
    other.data.uv_layers[0].name = "Half"
    bpy.ops.grating.assign()
    select(carrier)
    told = reports(lambda: bpy.ops.grating.bake_direction_map(size=32), capfd)
    assert f"waves does not read it: {other.name}: the direction map Plane Half frame was baked of Plane" in told
    assert grating.frame_kind == "STORED"


def no_faces(carrier):
    carrier.data.clear_geometry()


def no_map(carrier):
    while carrier.data.uv_layers:
        carrier.data.uv_layers.remove(carrier.data.uv_layers[0])


def outside(carrier):
    carrier.data.uv_layers["Half"].uv[0].vector = (1.2, 0)


def no_area(carrier):
    for corner in carrier.data.uv_layers["Half"].uv:
        corner.vector = (0.5, 0.5)


def mapped_already(carrier):
    bpy.ops.grating.bake_direction_map(size=16)
    bpy.data.images["Plane Half frame"].name = "first"


@pytest.mark.parametrize(("spoil", "told"), [
    (no_faces, "Plane: no faces to bake a direction map of; choose a mesh with faces"),
    (no_map, "Plane: no UV map for a direction map; unwrap it"),
    (outside, "Plane: its UV map Half leaves the picture's square; unwrap it, or pack it"),
    (no_area, "Plane: its UV map Half has no area; unwrap it"),
    (mapped_already, "Plane: its direction is from a direction map already; choose another Direction Source"),
])  # fmt: skip
def test_what_cannot_be_baked_is_told_and_unchanged(carrier, spoil, told):
    spoil(carrier)
    before = contents()
    with pytest.raises(RuntimeError, match=told) as found:
        bpy.ops.grating.bake_direction_map(size=16)
    assert len(str(found.value).strip().splitlines()) == 1
    assert contents() == before


def test_a_place_that_cannot_be_written_is_told(carrier):
    before = contents()
    for path, told in (("/proc/none/a.exr", "cannot be written|cannot bake"), ("/tmp/a.png", "written as OpenEXR")):
        with pytest.raises(RuntimeError, match=told):
            bpy.ops.grating.bake_direction_map(size=16, filepath=path)
    assert contents() == before


def test_undo_takes_the_map_away(carrier, addon):
    bpy.ops.ed.undo_push(message="Before")
    bpy.ops.grating.bake_direction_map(size=16)
    bpy.ops.ed.undo_push(message="Baked")
    bpy.ops.ed.undo()
    grating = bpy.context.scene.natural_gratings.active()
    assert grating.frame_kind == addon.group_properties.frame_of(grating.group).kind == "STORED"
    assert "Plane Half frame" not in bpy.data.images


def test_resampling_is_told_of_frame_maps_too(scene, carrier, addon):
    bpy.ops.grating.bake_direction_map(size=16)
    assert bpy.data.images["Plane Half frame"] in addon.data_pictures._pictures()


def test_the_command_line_bakes_and_saves(addon, scene, carrier, grating, tmp_path, capfd, monkeypatch):
    blend, picture = tmp_path / "plane.blend", tmp_path / "plane.exr"
    monkeypatch.chdir(tmp_path)
    line = ["direction-map", "--object", "Plane", "--size", "32", "-o", picture.name, "--save", str(blend)]
    assert addon.commands.execute(line) == 0
    assert blend.is_file() and picture.is_file() and grating.frame_kind == "FRAME_MAP"
    assert "no UV map Other" in fault(capfd, addon, "direction-map", "--object", "Plane", "--uv-map", "Other")
    assert "--size" in fault(capfd, addon, "direction-map", "--size", "nan")
