# SPDX-License-Identifier: GPL-3.0-or-later
"""Add > Natural Gratings in the shader editor: a grating, a preset and a pattern as nodes."""

import json
from types import SimpleNamespace

import bpy
import pytest

from tests.addon.layout import Layout, context_of
from tests.hostile.shader_editor import shader_editor

PLACE = (120.0, -40.0)


@pytest.fixture
def material(scene, addon):
    """The material of the plane, open in the shader editor."""
    made = bpy.data.materials.new("Paint")
    addon.compat.enable_nodes(made)
    bpy.context.object.data.materials.append(made)
    with shader_editor() as space:
        space.cursor_location = PLACE
        yield made


def selected(material):
    return [node for node in material.node_tree.nodes if node.select]


def test_a_grating_is_added_ready_to_use(material, grating, addon):
    """At the mouse, selected, with the look's values and hologram; the material's mesh and Cycles are prepared too."""
    grating.look.inputs = json.dumps({"Roughness": 0.25})
    grating.look.hologram = json.dumps({"pattern": "crystal"})
    bpy.context.object.scale.y = 0.5
    bpy.context.view_layer.update()
    assert bpy.ops.grating.add_grating_node(grating="waves") == {"FINISHED"}
    node = material.node_tree.nodes.active
    assert node.node_tree == grating.group and addon.material.diffraction_nodes(material) == [node]
    assert tuple(node.location) == PLACE
    assert node.inputs["Roughness"].default_value == 0.25
    pattern = addon.hologram_nodes.hologram_of(node)
    assert addon.hologram_nodes.pattern_of(pattern.node_tree) == "CRYSTAL"
    # The UV map's square fills the plane, so its shape is the plane's, to single precision.
    assert pattern.inputs["Aspect"].default_value == pytest.approx(0.5, rel=1e-5)
    # The pattern and its UV Map follow the mouse with the node.
    assert {each.type for each in selected(material)} == {"GROUP", "UVMAP"} and len(selected(material)) == 3
    assert material.cycles.emission_sampling == "NONE"
    output = next(each for each in material.node_tree.nodes if each.type == "OUTPUT_MATERIAL")
    link = material.node_tree.links.new(node.outputs["Shader"], output.inputs["Surface"])
    assert link.is_valid and addon.material.shows_diffraction(material, in_cycles=True)


def test_without_a_name_it_is_the_active_grating(material, grating):
    assert bpy.ops.grating.add_grating_node() == {"FINISHED"}
    assert material.node_tree.nodes.active.node_tree == grating.group


def test_it_works_while_the_mesh_is_edited(material, grating):
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        assert bpy.ops.grating.add_grating_node() == {"FINISHED"}
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")


def test_the_nodes_that_were_there_stay(material, grating):
    before = [node.name for node in material.node_tree.nodes]
    bpy.ops.grating.add_grating_node()
    assert [node.name for node in material.node_tree.nodes][: len(before)] == before
    assert [node.name for node in selected(material)] == [material.node_tree.nodes.active.name]


def test_a_mesh_without_a_uv_map_is_named(material, grating, capfd):
    data = bpy.context.object.data
    data.uv_layers.remove(data.uv_layers[0])
    bpy.ops.grating.add_grating_node()
    assert "Plane: no UV map, so no direction for the grating; press Comb Grating" in capfd.readouterr().out


@pytest.mark.parametrize(("spoil", "told"), [
    (lambda grating: setattr(grating, "bake_path", ""), "waves: not baked yet; press Bake Grating first"),
    (lambda grating: setattr(grating, "name", "lines"), "waves: no such grating in scene Scene; choose one of"),
    (lambda grating: setattr(grating.look, "inputs", "["), "waves: its inputs: "),
])  # fmt: skip
def test_what_cannot_be_added_is_refused_in_one_line(material, grating, spoil, told):
    spoil(grating)
    before = len(material.node_tree.nodes), len(bpy.data.node_groups)
    with pytest.raises(RuntimeError) as refusal:
        bpy.ops.grating.add_grating_node(grating="waves")
    assert told in str(refusal.value) and str(refusal.value).strip().count("\n") == 0
    assert (len(material.node_tree.nodes), len(bpy.data.node_groups)) == before


def test_a_group_is_not_added_to_itself(material, grating, addon):
    bpy.ops.grating.add_grating_node()
    inside = next(node.node_tree for node in grating.group.nodes if node.type == "GROUP")
    for tree in (grating.group, inside):
        place = addon.presets.Place(material, tree, PLACE)
        with pytest.raises(addon.presets.GratingError, match="its own node group is open; press Tab"):
            addon.presets.add_grating_node(bpy.context.scene, "", place)


def test_it_is_undone_and_redone(material, grating):
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.grating.add_grating_node()
    bpy.ops.ed.undo_push(message="node")
    bpy.ops.ed.undo()
    assert [node.type for node in bpy.data.materials["Paint"].node_tree.nodes if node.type == "GROUP"] == []
    bpy.ops.ed.redo()
    (node,) = [node for node in bpy.data.materials["Paint"].node_tree.nodes if node.type == "GROUP"]
    assert node.node_tree == bpy.context.scene.natural_gratings.active().group


def test_a_preset_is_added_to_the_scene_and_as_a_node(material, monkeypatch, addon, baked):
    """Where no draft ships, it is baked first."""
    monkeypatch.setattr(addon.presets, "bake_and_wait", lambda grating: setattr(grating, "bake_path", str(baked)))
    monkeypatch.setattr(addon.presets, "take_draft", lambda *_: None)
    assert bpy.ops.grating.add_preset_node(preset="gold_foil") == {"FINISHED"}
    grating = bpy.context.scene.natural_gratings.active()
    assert grating.name == "Gold Holographic Foil"
    (node,) = addon.material.diffraction_nodes(material)
    assert node.node_tree == grating.group
    for name, value in grating.look.inputs_for(grating.name).items():
        assert addon.hologram_nodes.input_set_by_artist(node, name).default_value == pytest.approx(value)


@pytest.mark.parametrize("pattern", ["DOT_MATRIX", "SUNBURST", "CRYSTAL"])
def test_a_pattern_is_added_with_its_uv_map(material, addon, pattern):
    bpy.context.object.scale.y = 2.0
    bpy.context.view_layer.update()
    assert bpy.ops.grating.add_pattern_node(pattern=pattern) == {"FINISHED"}
    node = material.node_tree.nodes.active
    assert addon.hologram_nodes.pattern_of(node.node_tree) == pattern
    assert node.inputs["Vector"].links[0].from_node.type == "UVMAP"
    assert node.inputs["Aspect"].default_value == pytest.approx(2.0, rel=1e-5)
    assert len(selected(material)) == 2


def test_it_needs_a_material_in_a_shader_editor(scene, grating):
    with pytest.raises(RuntimeError, match="Open a material in the shader editor first"):
        bpy.ops.grating.add_grating_node()
    # The plane has no material.
    with shader_editor(), pytest.raises(RuntimeError, match="Open a material in the shader editor first"):
        bpy.ops.grating.add_grating_node()


def test_a_linked_material_is_refused(scene, grating, addon, tmp_path):
    kept = bpy.data.materials.new("Kept")
    addon.compat.enable_nodes(kept)
    bpy.data.libraries.write(str(tmp_path / "guest.blend"), {kept}, fake_user=True)
    bpy.data.materials.remove(kept)
    with bpy.data.libraries.load(str(tmp_path / "guest.blend"), link=True) as (_, into):
        into.materials = ["Kept"]
    bpy.context.object.data.materials.append(into.materials[0])
    with shader_editor(), pytest.raises(RuntimeError, match="is linked from another file. Make it local first"):
        bpy.ops.grating.add_grating_node()


def drawn(menu):
    """What a menu draws."""
    layout = Layout()
    menu.draw(SimpleNamespace(layout=layout), context_of())
    return layout


def test_the_menu_lists_gratings_presets_and_patterns(addon, material, grating):
    layout = drawn(addon.add_node.NodeMenu)
    assert layout.operators == [f"grating.add_{kind}_node" for kind in ("grating", "preset", "pattern")]
    assert layout.contexts["grating.add_grating_node"] == "INVOKE_REGION_WIN"  # the node follows the mouse
    assert layout.labels == []
    bpy.context.scene.natural_gratings.items.clear()
    assert drawn(addon.add_node.NodeMenu).labels == ["No gratings in this scene yet"]


def test_the_entry_is_there_for_materials_alone(addon, material):
    shown = []
    entry = SimpleNamespace(layout=SimpleNamespace(menu=shown.append, separator=lambda: None))
    for space in (bpy.context.space_data, None):
        addon.add_node.menu_entry(entry, SimpleNamespace(space_data=space))
    assert shown == ["GRATING_MT_nodes"]
    bpy.context.space_data.shader_type = "WORLD"
    with shader_editor() as space:  # Blender looks for the node tree when an editor becomes the context
        addon.add_node.menu_entry(entry, SimpleNamespace(space_data=space))
    assert shown == ["GRATING_MT_nodes"]
