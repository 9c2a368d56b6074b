# SPDX-License-Identifier: GPL-3.0-or-later
"""Choosing where the scan's direction comes from: the stored choice, refusals, and the cost in nodes."""

import bpy
import numpy as np
import pytest

from tests.addon.conftest import reports, select


@pytest.fixture
def carrier(scene, grating):
    """The plane with the grating, lit only by lamps."""
    bpy.ops.grating.lights(lights="LAMPS")
    assert bpy.ops.grating.assign() == {"FINISHED"}
    return bpy.context.object


def nodes_of(grating) -> list[str]:
    return sorted(node.bl_idname for node in grating.group.nodes)


def test_the_choice_is_noted_and_told(scene, grating, carrier, addon, capfd):
    assert "waves: its direction is from the object's Y axis" in reports(
        lambda: bpy.ops.grating.direction(kind="AXIS", axis="Y", angle="grating_angle"), capfd
    )
    source = grating.frame_source()
    assert (source.kind, source.axis, source.angle) == ("AXIS", "Y", "grating_angle")
    assert addon.group_properties.frame_of(grating.group) == source


def test_a_group_made_later_has_the_choice(scene, grating, addon):
    bpy.ops.grating.direction(kind="RADIAL")
    bpy.ops.grating.new_material()
    assert addon.group_properties.frame_of(grating.group).kind == "RADIAL"


def test_only_the_chosen_source_costs_nodes(scene, grating, carrier, addon):
    """The default has only a Tangent node, an axis a transform in its place. The footprint, off here, has both."""
    grating.footprint = False
    addon.making_materials.follow_settings()
    default = nodes_of(grating)
    assert default.count("ShaderNodeTangent") >= 1 and "ShaderNodeTexCoord" not in default
    transforms = default.count("ShaderNodeVectorTransform")
    bpy.ops.grating.direction(kind="AXIS")
    chosen = nodes_of(grating)
    assert "ShaderNodeTangent" not in chosen and "ShaderNodeUVMap" not in chosen
    assert chosen.count("ShaderNodeVectorTransform") == transforms + 1 and len(chosen) <= len(default)
    bpy.ops.grating.direction(kind="AXIS", angle="grating_angle")
    # An Attribute node and a sum.
    assert len(nodes_of(grating)) == len(chosen) + 2
    bpy.ops.grating.direction(kind="STORED")
    assert nodes_of(grating) == default


def test_links_to_the_node_stay(scene, grating, carrier, addon):
    (node,) = addon.material.diffraction_nodes(carrier.active_material)
    tree = node.id_data
    tree.links.new(tree.nodes.new("ShaderNodeValue").outputs[0], node.inputs["Rotation"])
    bpy.ops.grating.direction(kind="RADIAL")
    assert node.inputs["Rotation"].is_linked and node.outputs["Shader"].is_linked


@pytest.mark.parametrize(("choice", "told"), [
    ({"kind": "UV_MAP"}, "waves: no UV map is named for its direction; name one"),
    ({"kind": "UV_MAP", "uv_map": "Other"}, "Plane: no UV map Other, from which the grating takes its direction; "),
    ({"kind": "FRAME_MAP"}, "waves: no picture is no direction map; use Bake Direction Map"),
    ({"kind": "FRAME_MAP", "frame_map": "waves"}, "waves: waves is no direction map; use Bake Direction Map"),
])  # fmt: skip
def test_what_is_missing_is_told_and_nothing_changes(scene, grating, carrier, addon, choice, told):
    before = grating.frame_source()
    with pytest.raises(RuntimeError, match=told) as fault:
        bpy.ops.grating.direction(**choice)
    assert len(str(fault.value).strip().splitlines()) == 1
    assert grating.frame_source() == before and addon.group_properties.frame_of(grating.group) == before


def test_a_mesh_without_a_uv_map_takes_an_axis(scene, grating):
    plane = bpy.context.object
    plane.data.uv_layers.remove(plane.data.uv_layers[0])
    bpy.ops.grating.direction(kind="AXIS", axis="X")
    assert bpy.ops.grating.assign() == {"FINISHED"}


def test_a_mesh_without_the_named_map_is_not_assigned(scene, grating):
    bpy.ops.grating.direction(kind="UV_MAP", uv_map="Body")
    with pytest.raises(RuntimeError, match="Plane: no UV map Body"):
        bpy.ops.grating.assign()
    bpy.context.object.data.uv_layers[0].name = "Body"
    assert bpy.ops.grating.assign() == {"FINISHED"}


def test_seams_are_those_of_the_map_that_is_chosen(scene, grating, capfd):
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.grating.direction(kind="AXIS")
    assert "UV islands" not in reports(bpy.ops.grating.assign, capfd)
    bpy.ops.grating.direction(kind="UV_MAP", uv_map="UVMap")
    assert "UV islands" in reports(bpy.ops.grating.assign, capfd)


def test_a_frame_map_that_is_gone_leaves_the_default(scene, grating, carrier, addon):
    image = bpy.data.images.new("frames", 8, 8, float_buffer=True)
    addon.tangent_frame.note_mesh(image, carrier, "UVMap")
    bpy.ops.grating.direction(kind="FRAME_MAP", frame_map="frames")
    assert addon.group_properties.frame_of(grating.group).frame_map == image
    bpy.data.images.remove(image)
    assert grating.frame_source().kind == addon.group_properties.frame_of(grating.group).kind == "STORED"
    bpy.ops.grating.lights(lights="REST")


def test_a_frame_map_of_another_mesh_is_refused(scene, grating, carrier, addon):
    image = bpy.data.images.new("frames", 8, 8, float_buffer=True)
    addon.tangent_frame.note_mesh(image, carrier, "UVMap")
    carrier.data.uv_layers[0].uv[0].vector = (0.3, 0.4)
    told = (
        "Plane: the direction map frames was baked of Plane, with other faces or another UVMap; use Bake Direction Map"
    )
    with pytest.raises(RuntimeError, match=told):
        bpy.ops.grating.direction(kind="FRAME_MAP", frame_map="frames")
    assert grating.frame_source().kind == "STORED"


def test_a_moved_vertex_leaves_a_frame_map_valid(scene, carrier, addon):
    image = bpy.data.images.new("frames", 8, 8, float_buffer=True)
    addon.tangent_frame.note_mesh(image, carrier, "UVMap")
    carrier.data.vertices[0].co.z = 0.2
    addon.tangent_frame.check_frame_map(carrier, image)


def test_undo_brings_the_source_back(scene, grating, carrier, addon):
    bpy.ops.ed.undo_push(message="Before")
    bpy.ops.grating.direction(kind="AXIS", axis="X")
    bpy.ops.ed.undo_push(message="Chosen")
    bpy.ops.ed.undo()
    grating = bpy.context.scene.natural_gratings.active()
    assert grating.frame_kind == "STORED" and addon.group_properties.frame_of(grating.group).kind == "STORED"
    assert "ShaderNodeTangent" in nodes_of(grating)


def test_the_lamp_of_a_spectrum_has_the_frame_of_the_source(scene, grating, carrier):
    """On a plane turned about its normal, with its own angle attribute: the lamp's X axis is T, turned by both."""
    carrier.rotation_euler = (0, 0, 0.4)
    carrier["grating_angle"] = 0.3
    bpy.ops.grating.direction(kind="AXIS", axis="Y", angle="grating_angle")
    bpy.context.view_layer.update()
    scene.render.engine = "CYCLES"
    select(carrier)
    bpy.ops.grating.add_diffraction_lamp(size_mm=1)
    lamp = next(o for o in bpy.data.objects if o.type == "LIGHT" and "ng_fan" in o.data)
    bpy.context.view_layer.update()
    x = np.array(lamp.matrix_world.col[0][:3])
    turn = np.pi / 2 + 0.4 + 0.3
    # Single precision, through the product of two matrices.
    np.testing.assert_allclose(x / np.linalg.norm(x), (np.cos(turn), np.sin(turn), 0), atol=1e-6)


def test_the_field_in_numpy_knows_every_source(scene, addon):
    """On a plane in x and y with a mirrored, stretched UV map: U runs along -x."""
    mesh = bpy.context.object.data
    for corner in mesh.uv_layers[0].uv:
        u, v = corner.vector
        corner.vector = (1 - 3 * u, v)
    mesh.calc_loop_triangles()
    shares = np.full((2, 3), 1 / 3)

    def tangents(**choice):
        source = addon.direction_source.DirectionSource(**choice)
        return addon.tangents.frame_field(mesh, np.arange(2), shares=shares, source=source)

    stored = tangents()
    np.testing.assert_allclose(stored.tangents, [(-1, 0, 0)] * 2, atol=1e-6)
    np.testing.assert_allclose(stored.normals, [(0, 0, 1)] * 2, atol=1e-6)
    np.testing.assert_allclose(tangents(kind="UV_MAP", uv_map="UVMap").tangents, stored.tangents)
    np.testing.assert_allclose(tangents(kind="AXIS", axis="Y").tangents, [(0, 1, 0)] * 2)
    assert np.isnan(tangents(kind="AXIS", axis="Z").tangents).all()
    outwards = stored.points / np.linalg.norm(stored.points, axis=1, keepdims=True)
    np.testing.assert_allclose(tangents(kind="RADIAL").tangents, outwards, atol=1e-6)
    image = bpy.data.images.new("frames", 4, 4, float_buffer=True)
    image.pixels.foreach_set(np.tile(np.float32([0.5, 1.0, 0, 1]), 16))  # a quarter turn
    image[addon.direction_source.BAKED_OF] = {"uv_map": "UVMap"}
    np.testing.assert_allclose(tangents(kind="FRAME_MAP", frame_map=image).tangents, [(0, -1, 0)] * 2, atol=1e-6)
    for corner in mesh.uv_layers[0].uv:
        corner.vector = (0, 0)
    assert np.isnan(tangents().tangents).all()
