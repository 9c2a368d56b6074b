# SPDX-License-Identifier: GPL-3.0-or-later
"""Holograms: the nodes of each pattern, the links that it takes over and gives back, what keeps it, and refusals."""

import math

import bpy
import numpy as np
import pytest
from PIL import Image

from tests.addon.conftest import reports, select

CHANGED = ("Rotation", "Period Scale", "Strength")
# The operator's arguments, and the pattern's inputs that they set.
GIVEN = {
    "DOT_MATRIX": ({"cells": 30.0, "turn": 0.4, "spread": 1.5, "seed": 2.0}, {"Cells": 30.0, "Turn": 0.4}),
    "SUNBURST": ({"twist": 0.3, "sectors": 8.0, "center_x": 0.2}, {"Twist": 0.3, "Sectors": 8.0, "Center X": 0.2}),
    "CRYSTAL": ({"shards": 5.0, "randomness": 0.5}, {"Shards": 5.0, "Randomness": 0.5}),
    "PICTURE": ({"picture_cells": 20.0, "grey_below": 0.2}, {"Cells": 20.0, "Grey Below": 0.2}),
}


@pytest.fixture
def assigned(scene, grating):
    """The grating, on the plane."""
    bpy.ops.grating.lights(lights="LAMPS")
    assert bpy.ops.grating.assign() == {"FINISHED"}
    return grating


@pytest.fixture
def picture(tmp_path):
    """A picture of one blue-green."""
    path = tmp_path / "logo.png"
    Image.new("RGB", (8, 8), (0, 255, 128)).save(path)
    return path


@pytest.fixture
def add(picture):
    """Add a pattern with its arguments of GIVEN or others."""

    def added(pattern, **given):
        file = {"filepath": str(picture)} if pattern == "PICTURE" else {}
        return bpy.ops.grating.hologram(pattern=pattern, **(file | (given or GIVEN[pattern][0])))

    return added


def diffraction(addon, material):
    (node,) = addon.material.diffraction_nodes(material)
    return node


def sources(addon, material):
    """The node that feeds each input that holograms change."""
    node = diffraction(addon, material)
    return [links[0].from_node if (links := node.inputs[name].links) else None for name in CHANGED]


@pytest.mark.parametrize("pattern", GIVEN)
def test_each_pattern_feeds_the_node_with_the_chosen_numbers(assigned, addon, add, pattern):
    assert add(pattern) == {"FINISHED"}
    node, *others = sources(addon, assigned.material)
    assert others == [node, node] and node.label == addon.patterns.LABELS[pattern]
    for name, value in GIVEN[pattern][1].items():
        assert node.inputs[name].default_value == pytest.approx(value)
    (link,) = node.inputs["Vector"].links
    assert link.from_node.type == "UVMAP" and link.from_node.uv_map == ""


@pytest.mark.night("test_each_pattern_feeds_the_node_with_the_chosen_numbers")
@pytest.mark.parametrize("pattern", GIVEN)
def test_the_group_has_tooltips_units_and_blender_s_own_nodes(assigned, addon, add, pattern):
    add(pattern)
    group = sources(addon, assigned.material)[0].node_tree
    items = {item.name: item for item in group.interface.items_tree if item.in_out == "INPUT"}
    assert all(item.description for item in items.values())
    angles = {name for name, item in items.items() if getattr(item, "subtype", "") == "ANGLE"}
    assert angles == {"Rotation", "Turn", "Twist"} & set(items)
    assert all(node.bl_idname.startswith(("ShaderNode", "NodeGroup")) for node in group.nodes)
    assert all(node.type != "GROUP" for node in group.nodes)


def test_fields_and_inputs_agree(addon):
    patterns, operator = addon.patterns, addon.vary
    shown = bpy.ops.grating.hologram.get_rna_type().properties
    for sockets in patterns.OWN_INPUTS.values():
        for socket in sockets:
            field = shown[operator.FIELDS[socket]]
            assert (field.name, field.description) == (socket.name, socket.text)
            limits = (field.default, field.hard_min, field.hard_max)
            assert limits == pytest.approx((socket.default, socket.low, socket.high))
            assert field.subtype == (socket.subtype or "NONE")


def patterns_in_file():
    """The patterns' node groups. Before Blender 5.0 a replaced group is only emptied (compat.remove_replaced)."""
    groups = bpy.data.node_groups
    assert not any(group.nodes for group in groups if group.name.startswith("Replaced"))
    return [group.name for group in groups if group.name.startswith("Hologram")]


def test_values_and_links_pass_through_and_come_back(assigned, addon, add):
    material = assigned.material
    node, tree = diffraction(addon, material), material.node_tree
    node.inputs["Rotation"].default_value, node.inputs["Strength"].default_value = 0.7, 3.0
    number = tree.nodes.new("ShaderNodeValue")
    tree.links.new(number.outputs[0], node.inputs["Period Scale"])
    names = sorted(each.name for each in tree.nodes)
    add("DOT_MATRIX")
    add("CRYSTAL")
    pattern = addon.hologram_nodes.hologram_of(node)
    assert pattern.inputs["Rotation"].default_value == pytest.approx(0.7)
    assert pattern.inputs["Strength"].default_value == 3.0
    assert pattern.inputs["Period Scale"].links[0].from_node == number
    assert len(tree.nodes) == len(names) + 2, "one pattern and its UV Map"
    assert patterns_in_file() == ["Hologram Crystal"]
    pattern.inputs["Rotation"].default_value = 0.9
    add("NONE", seed=0.0)
    assert sources(addon, material) == [None, number, None]
    assert node.inputs["Rotation"].default_value == pytest.approx(0.9) and node.inputs["Strength"].default_value == 3.0
    assert sorted(each.name for each in tree.nodes) == names
    assert not patterns_in_file()


def test_another_pattern_keeps_the_artist_s_coordinates(assigned, addon, add):
    add("DOT_MATRIX")
    tree = assigned.material.node_tree
    mapping = tree.nodes.new("ShaderNodeMapping")
    tree.links.new(mapping.outputs[0], sources(addon, assigned.material)[0].inputs["Vector"])
    add("CRYSTAL")
    assert sources(addon, assigned.material)[0].inputs["Vector"].links[0].from_node == mapping


def test_a_link_that_the_artist_cut_stays_with_the_node(assigned, addon, add):
    add("DOT_MATRIX")
    node = diffraction(addon, assigned.material)
    assigned.material.node_tree.links.remove(node.inputs["Strength"].links[0])
    node.inputs["Strength"].default_value = 5.0
    add("CRYSTAL")
    assert addon.hologram_nodes.hologram_of(node).inputs["Strength"].default_value == 5.0


def test_a_new_bake_assigning_and_variation_keep_it(assigned, addon, add):
    add("DOT_MATRIX")
    before = sources(addon, assigned.material)
    addon.making_materials.refresh_group(assigned)
    bpy.ops.mesh.primitive_plane_add()
    bpy.ops.grating.assign()
    bpy.ops.grating.vary(turn=0.2)
    assert sources(addon, assigned.material) == before and None not in before


def test_it_is_there_in_a_file_that_is_opened_again(assigned, addon, add, tmp_path):
    add("PICTURE")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "foil.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "foil.blend"))
    grating = bpy.context.scene.natural_gratings.items[0]
    node = sources(addon, grating.material)[0]
    assert addon.hologram_nodes.pattern_of(node.node_tree) == "PICTURE"
    (image,) = [each.image for each in node.node_tree.nodes if each.type == "TEX_IMAGE"]
    assert image.packed_file is not None and image.colorspace_settings.is_data
    assert addon.varying_inputs.hologram_summary(grating.group) == "From Picture"


def test_undo_takes_it_back(assigned, addon, add):
    bpy.ops.ed.undo_push(message="Before")
    add("DOT_MATRIX")
    bpy.ops.ed.undo_push(message="Hologram")
    bpy.ops.ed.undo()
    material = bpy.context.scene.natural_gratings.items[0].material
    assert sources(addon, material) == [None] * 3
    bpy.ops.ed.redo()
    assert None not in sources(addon, bpy.context.scene.natural_gratings.items[0].material)


def test_remove_diffraction_removes_it(scene, grating, addon, add):
    plane = bpy.context.object
    own = bpy.data.materials.new("Card")
    addon.compat.enable_nodes(own)
    plane.data.materials.append(own)
    before = sorted(node.name for node in own.node_tree.nodes)
    bpy.ops.grating.add_diffraction()
    add("DOT_MATRIX")
    bpy.ops.grating.remove_diffraction()
    assert sorted(node.name for node in own.node_tree.nodes) == before


def test_materials_share_a_group_until_an_artist_changes_it(assigned, addon, add):
    add("CRYSTAL")
    first = sources(addon, assigned.material)[0].node_tree
    assigned.material = None
    bpy.ops.mesh.primitive_plane_add()
    bpy.ops.grating.assign()
    add("CRYSTAL")
    assert sources(addon, assigned.material)[0].node_tree == first
    first.nodes.remove(next(node for node in first.nodes if node.type == "TEX_VORONOI"))
    add("CRYSTAL")
    assert sources(addon, assigned.material)[0].node_tree != first


def test_cells_are_square_on_a_card(assigned, addon, add):
    plane = bpy.context.object
    plane.scale = (1.0, 0.6, 1.0)
    bpy.context.view_layer.update()
    add("DOT_MATRIX")
    assert sources(addon, assigned.material)[0].inputs["Aspect"].default_value == pytest.approx(0.6, rel=1e-5)


def test_the_aspect_of_maps(scene, addon):
    plane = bpy.context.object
    aspect = addon.uv_maps.uv_aspect
    uv = plane.data.uv_layers[0].uv
    for corner in uv:
        corner.vector = (corner.vector[1] * 0.5, -corner.vector[0])
    assert aspect(plane) == pytest.approx(0.5), "the UV square is two meshes wide and one high"
    for corner in uv:
        corner.vector = (0.5, 0.5)
    assert aspect(plane) == 1.0


def test_without_a_selected_grating_all_of_the_active_one_get_it(assigned, addon, add, capfd):
    bpy.ops.object.select_all(action="DESELECT")
    assert "Diffraction waves: Dot Matrix" in reports(lambda: add("DOT_MATRIX"), capfd)
    assert None not in sources(addon, assigned.material)
    assert "hologram removed" in reports(lambda: add("NONE", seed=0.0), capfd)
    assert "has no hologram" in reports(lambda: add("NONE", seed=0.0), capfd)


def refused(add, line, pattern="DOT_MATRIX", **given):
    """The operator fails with one line, and the file holds what it held."""
    kinds = (bpy.data.node_groups, bpy.data.images, bpy.data.materials)
    before = [sorted(each.name for each in kind) for kind in kinds]
    nodes = [len(material.node_tree.nodes) for material in bpy.data.materials]
    with pytest.raises(RuntimeError) as told:
        add(pattern, **given)
    assert line in str(told.value) and len(str(told.value).strip().splitlines()) == 1
    assert [sorted(each.name for each in kind) for kind in kinds] == before
    assert [len(material.node_tree.nodes) for material in bpy.data.materials] == nodes


def test_without_a_material_or_a_uv_map_it_is_refused(scene, grating, add):
    refused(add, "waves: no mesh shows it yet; press Assign to Selected first")
    bpy.ops.grating.assign()
    plane = bpy.context.object
    refused(add, "Plane: no UV map Second for the pattern", uv_map="Second")
    plane.data.uv_layers.remove(plane.data.uv_layers[0])
    refused(add, "Plane: no UV map for the pattern; unwrap the mesh")


def test_pictures_that_cannot_be_read_are_refused(assigned, add, tmp_path):
    refused(add, "From Picture needs a picture; choose a file", "PICTURE", filepath="")
    missing, text, folder = (tmp_path / name for name in ("missing.png", "text.png", "folder.png"))
    text.write_text("no picture")
    folder.mkdir()
    refused(add, f"{missing}: no such file; choose a picture", "PICTURE", filepath=str(missing))
    refused(add, f"{folder}: no such file; choose a picture", "PICTURE", filepath=str(folder))
    refused(add, f"{text}: not a picture that Blender reads; choose", "PICTURE", filepath=str(text))


def test_the_same_picture_is_loaded_once_and_a_changed_one_again(assigned, addon, add, picture):
    held = len(bpy.data.images)
    add("PICTURE")
    add("PICTURE")
    assert len(bpy.data.images) == held + 1
    Image.new("RGB", (8, 8), (255, 0, 0)).save(picture)
    add("PICTURE")
    (image,) = [n.image for n in sources(addon, assigned.material)[0].node_tree.nodes if n.type == "TEX_IMAGE"]
    np.testing.assert_allclose(image.pixels[:3], (1, 0, 0))


def test_a_mesh_without_a_uv_map_is_told_of(assigned, addon, add, capfd):
    plane = bpy.context.object
    other = plane.copy()
    other.data = plane.data.copy()
    other.data.uv_layers.remove(other.data.uv_layers[0])
    bpy.context.scene.collection.objects.link(other)
    select(plane, other)
    assert "Plane.001: has no UV map for the hologram; it shows one cell" in reports(lambda: add("CRYSTAL"), capfd)


def test_rings_under_another_direction_are_told_of(assigned, add, capfd):
    bpy.ops.grating.direction(kind="RADIAL", axis="Z")
    assert "need the Direction UV Map; with Radial" in reports(lambda: add("SUNBURST"), capfd)


def test_set_of_the_batch_verb_reaches_the_hologram(assigned, addon, add, baked, tmp_path):
    add("DOT_MATRIX")
    line = ["assign", str(baked), "--object", "Plane", "--set", "Rotation=90", "--save", str(tmp_path / "set.blend")]
    assert addon.commands.execute(line) == 0
    pattern = sources(addon, assigned.material)[0]
    assert pattern.inputs["Rotation"].default_value == pytest.approx(math.pi / 2)


def test_the_verb_adds_and_saves(assigned, addon, picture, tmp_path, capfd):
    blend = tmp_path / "card.blend"
    line = ["hologram", "picture", "--picture", str(picture), "--object", "Plane", "--set", "Cells=20"]
    assert addon.commands.execute([*line, "--save", str(blend)]) == 0
    assert "Diffraction waves: From Picture" in capfd.readouterr().out
    bpy.ops.wm.open_mainfile(filepath=str(blend))
    node = sources(addon, bpy.context.scene.natural_gratings.items[0].material)[0]
    assert node.label == "From Picture" and node.inputs["Cells"].default_value == 20.0


@pytest.mark.parametrize(("line", "told"), [
    (["stars"], "invalid choice: 'stars'"),
    (["crystal", "--set", "Cells=3"], "--set Cells=3: no such input; there are Shards, Randomness"),
    (["crystal", "--set", "Turn=120"], "--set Turn=120: Turn is a number from 0 to 90 degrees"),
    (["crystal", "--picture", "a.png"], "--picture: crystal reads no picture; leave it out"),
    (["none", "--set", "Turn=3"], "--set: none has no inputs; leave it out"),
    (["picture"], "From Picture needs a picture; choose a file"),
    (["crystal", "--uv-map", "Second"], "Plane: no UV map Second for the pattern; unwrap"),
])  # fmt: skip
def test_faults_of_the_verb_are_one_line(assigned, addon, tmp_path, capfd, line, told):
    capfd.readouterr()
    assert addon.commands.execute(["hologram", *line, "--object", "Plane", "--save", str(tmp_path / "a.blend")]) != 0
    (error,) = [each for each in capfd.readouterr().err.splitlines() if each.startswith("error:")]
    assert told in error and not (tmp_path / "a.blend").exists()


def test_a_bake_for_one_scene_is_told_of(assigned, addon, add, capfd):
    addon.response.response_in(assigned.group).group["ng_region"] = [-1.0, 1.0, -1.0, 1.0, 0.5, 2.0]
    assert "so parts may be black; press Bake for This Scene again" in reports(lambda: add("CRYSTAL"), capfd)


def test_a_method_without_a_period_scale_is_told_of(assigned, addon, add, capfd):
    """As an OSL reference of one of the thesis's methods."""
    response = addon.response.response_in(assigned.group)
    for item in list(response.group.interface.items_tree):
        if item.name == "Period Scale":
            response.group.interface.remove(item)
    assert "its method has no Period Scale, so the hologram's periods have no" in reports(lambda: add("CRYSTAL"), capfd)


def test_a_pattern_that_an_artist_changed_is_replaced(assigned, addon, add):
    """Sockets of its group were deleted, and one has another type."""
    add("DOT_MATRIX")
    group = sources(addon, assigned.material)[0].node_tree
    items = {item.name: item for item in group.interface.items_tree if item.in_out == "INPUT"}
    items["Rotation"].socket_type = "NodeSocketColor"
    for name in ("Strength", "Vector", "Aspect"):
        group.interface.remove(items[name])
    add("CRYSTAL")
    node = sources(addon, assigned.material)[0]
    assert node.label == "Crystal" and node.inputs["Vector"].is_linked
