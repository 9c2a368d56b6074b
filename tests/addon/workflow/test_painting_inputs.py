# SPDX-License-Identifier: GPL-3.0-or-later
"""Painted strength, direction and period: the nodes, the attribute of every mesh with the material, and refusals."""

import bpy
import numpy as np
import pytest

INPUTS = ("Strength", "Rotation", "Period Scale")


@pytest.fixture
def node(addon, scene, grating):
    """The Diffraction node of the plane's material."""
    bpy.ops.grating.assign()
    (found,) = addon.material.diffraction_nodes(grating.material)
    return found


def mapped(spread, value):
    """What the Map Range node makes of a value."""
    low, high = (spread.inputs[f"To {end}"].default_value for end in ("Min", "Max"))
    return low + value * (high - low)


@pytest.mark.parametrize("name", INPUTS)
@pytest.mark.parametrize("by", ["ATTRIBUTE", "TEXTURE", "GROUP"])
def test_a_clean_mask_changes_nothing(addon, node, name, by):
    node.inputs["Strength"].default_value = 0.7
    before = node.inputs[name].default_value
    assert bpy.ops.grating.paint(input=name, by=by) == {"FINISHED"}
    spread = addon.group_properties.paint_of(node.inputs[name])
    source = spread.inputs["Value"].links[0].from_node
    if by == "ATTRIBUTE":
        colours = np.empty(4 * 4, np.float32)
        bpy.context.active_object.data.color_attributes[source.attribute_name].data.foreach_get("color", colours)
        clean = colours.reshape(4, 4)[:, 0]
        assert np.ptp(clean) == 0
    elif by == "GROUP":
        thing = bpy.context.active_object
        assert thing.vertex_groups.active.name == source.attribute_name
        clean = [thing.vertex_groups.active.weight(index) for index in range(4)]
        assert np.ptp(clean) == 0
    else:
        clean = np.array(source.image.pixels[:4])[:1]
        assert source.image.colorspace_settings.name == "Non-Color" and source.image.packed_file is not None
    # Textures have 8 bits: half of a step of the range, of which Rotation's is pi.
    assert mapped(spread, clean[0]) == pytest.approx(before, abs=np.pi / 255 if by == "TEXTURE" else 1e-6)


def test_every_mesh_with_the_material_has_the_attribute(scene, grating, node):
    plane = bpy.context.active_object
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.active_object.data.materials.append(grating.material)
    bpy.context.view_layer.objects.active = plane
    bpy.ops.grating.paint(input="Strength", by="ATTRIBUTE")
    names = [thing.data.color_attributes.active_color.name for thing in scene.objects if thing.type == "MESH"]
    assert names == ["waves Strength"] * 2


def test_painting_again_goes_on_and_unpainting_gives_the_number_back(addon, node):
    node.inputs["Strength"].default_value = 0.4
    count = len(node.id_data.nodes)
    for _ in range(2):
        bpy.ops.grating.paint(input="Strength", by="ATTRIBUTE")
    assert len(node.id_data.nodes) == count + 2
    assert bpy.ops.grating.unpaint(input="Strength") == {"FINISHED"}
    assert len(node.id_data.nodes) == count and not node.inputs["Strength"].is_linked
    assert node.inputs["Strength"].default_value == pytest.approx(0.4)
    with pytest.raises(RuntimeError, match="Plane: its Strength is not painted; paint it first"):
        bpy.ops.grating.unpaint(input="Strength")


def test_under_a_hologram_the_pattern_s_own_input_is_painted(addon, node):
    bpy.ops.grating.hologram(pattern="DOT_MATRIX")
    bpy.ops.grating.paint(input="Strength", by="ATTRIBUTE")
    pattern = addon.hologram_nodes.hologram_of(node)
    assert pattern is not None and addon.group_properties.paint_of(pattern.inputs["Strength"]) is not None


def test_an_own_vertex_group_or_texture_is_the_mask(addon, node, scene, grating):
    plane = bpy.context.active_object
    plane.vertex_groups.new(name="Front").add([0, 1], 1.0, "REPLACE")
    assert bpy.ops.grating.paint(input="Strength", by="GROUP", group="Front") == {"FINISHED"}
    spread = addon.group_properties.paint_of(node.inputs["Strength"])
    assert spread.inputs["Value"].links[0].from_node.attribute_name == "Front"
    assert plane.vertex_groups["Front"].weight(0) == 1.0
    image = bpy.data.images.new("Mine", 8, 8)
    lines = addon.varying_inputs.paint_input(scene, plane, "Rotation", by="TEXTURE", source="Mine")
    spread = addon.group_properties.paint_of(node.inputs["Rotation"])
    assert spread.inputs["Value"].links[0].from_node.image == image
    assert "set its Color Space to Non-Color" in lines[1]


def test_it_names_the_meshes_without_the_vertex_group(addon, scene, grating, node):
    plane = bpy.context.active_object
    plane.vertex_groups.new(name="Front")
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.active_object.data.materials.append(grating.material)
    lines = addon.varying_inputs.paint_input(scene, plane, "Strength", by="GROUP", source="Front")
    assert "Cube: no vertex group Front, so the mask is black there" in lines


def nodes_set_it(node, _):
    value = node.id_data.nodes.new("ShaderNodeValue")
    node.id_data.links.new(value.outputs[0], node.inputs["Strength"])


def without_uv(_, plane):
    plane.data.uv_layers.remove(plane.data.uv_layers[0])


def another_material(_, plane):
    plane.active_material = bpy.data.materials.new("Plain")


@pytest.mark.parametrize(("spoil", "by", "line"), [
    (nodes_set_it, "ATTRIBUTE", "Plane: nodes set its Strength; unlink the input in the material first"),
    (without_uv, "TEXTURE", "Plane: no UV map for a texture; unwrap it, or paint a colour attribute"),
    (another_material, "ATTRIBUTE", "Plane: its active material does not show waves; press Assign to Selected"),
    (lambda *_: None, "GROUP", "nothing: no such vertex group on Plane; choose another, or leave the field empty"),
    (lambda *_: None, "TEXTURE", "nothing: no such picture in the file; choose another, or leave the field empty"),
])  # fmt: skip
def test_what_cannot_be_painted_is_refused_and_unchanged(node, spoil, by, line):
    plane = bpy.context.active_object
    spoil(node, plane)
    count = len(node.id_data.nodes)
    with pytest.raises(RuntimeError, match=line):
        sources = {"image": "nothing", "group": "nothing"} if "nothing" in line else {}
        bpy.ops.grating.paint(input="Strength", by=by, **sources)
    assert (
        len(node.id_data.nodes) == count and not plane.data.color_attributes and "waves Strength" not in bpy.data.images
    )


def test_the_dials_tell_what_is_painted(addon, scene, node):
    from types import SimpleNamespace

    from tests.addon.layout import Layout, context_of

    bpy.ops.grating.paint(input="Rotation", by="ATTRIBUTE")
    layout = Layout(folded=False)
    addon.panel.GratingPanel.draw(SimpleNamespace(layout=layout), context_of())
    assert "Rotation: painted" in layout.labels
    assert layout.operators.count("grating.paint") == 3 and layout.operators.count("grating.unpaint") == 1
