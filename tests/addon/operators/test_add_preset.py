# SPDX-License-Identifier: GPL-3.0-or-later
"""Add Preset: the operator, the grating, and the material that is made of it."""

import importlib
import json
from types import SimpleNamespace

import bpy
import pytest

from devtools import EXTENSION
from precompute.presets.presets import INPUTS, PATTERNS, draft_request, preset_names, read_preset


@pytest.fixture
def module(addon):
    return importlib.import_module(f"{EXTENSION}.addon.operators.add_preset")


@pytest.mark.short("[cd", "gold_foil", "jewel_beetle", "security_hologram", "sunbeam_snake")
@pytest.mark.parametrize("name", preset_names())
def test_it_adds_a_grating_with_the_request_and_the_look_of_the_file(scene, name):
    assert bpy.ops.grating.add_preset(preset=name, assign=False) == {"FINISHED"}
    grating, preset = scene.natural_gratings.active(), read_preset(name)
    assert grating.name == preset.title
    draft = draft_request(preset.request).as_dict() | {"coherence_um": pytest.approx(10.0)}
    assert grating.bake_request().as_dict() == draft
    assert grating.source == grating.source_file() == preset.request.scans[0].source
    assert tuple(grating.look.base_color) == pytest.approx(preset.base_color)
    assert grating.look.base_roughness == pytest.approx(preset.base_roughness)
    assert grating.frame_kind == preset.direction.upper()
    assert grating.look.inputs_for(grating.name) == preset.inputs
    hologram = grating.look.hologram_for(grating.name)
    assert (hologram and hologram.as_dict()) == (preset.hologram and preset.hologram.as_dict())
    assert grating.summary and grating.quality


def test_the_same_preset_is_not_added_twice(scene):
    for _ in range(2):
        bpy.ops.grating.add_preset(preset="gold_foil", assign=False)
    bpy.ops.grating.import_height_map(filepath="sample:cd")
    bpy.ops.grating.add_preset(preset="cd", assign=False)
    scene.natural_gratings.items[-1].delta_e = 2.0
    bpy.ops.grating.add_preset(preset="cd", assign=False)
    names = [grating.name for grating in scene.natural_gratings.items]
    assert names == ["Gold Holographic Foil", "CD", "CD.001", "CD.002"]


def test_an_unknown_preset_is_refused(scene):
    with pytest.raises(TypeError):
        bpy.ops.grating.add_preset(preset="toad")
    assert len(scene.natural_gratings.items) == 0


def test_a_faulty_file_is_reported_in_one_line(module, monkeypatch):
    presets = importlib.import_module(f"{EXTENSION}.precompute.presets.presets")
    faulty = presets.GratingError("cd.json", "title: is missing", "add `title`")

    def fail(*_):
        raise faulty

    monkeypatch.setattr(presets, "read_preset", fail)
    monkeypatch.setattr(importlib.import_module(f"{EXTENSION}.addon.workflow.presets"), "read_preset", fail)
    assert module._item("cd") == ("cd", "cd", str(faulty))
    with pytest.raises(RuntimeError, match="cd.json: title: is missing; add `title`"):
        bpy.ops.grating.add_preset(preset="cd", assign=False)


def test_the_enumeration_is_the_folder_s(module):
    items = module.presets(None, None)
    assert [name for name, *_ in items] == list(preset_names())
    titles = [read_preset(name).title for name in preset_names()]
    assert [title for _, title, _ in items] == titles
    assert module.presets(None, None) is items  # Blender needs the same texts each time


def test_the_menu_lists_them(addon):
    drawn = []

    class Layout(SimpleNamespace):
        def operator(self, name, text, icon_value):  # without a window there are no pictures
            drawn.append((self.operator_context, name, text))
            return SimpleNamespace()

    addon.panel.PresetMenu.draw(SimpleNamespace(layout=Layout()), None)
    titles = [read_preset(name).title for name in preset_names()]
    assert sorted(drawn) == sorted(("EXEC_DEFAULT", "grating.add_preset", title) for title in titles)


def test_the_inputs_of_presets_are_those_of_the_node(addon):
    settable = addon.skin.SETTABLE
    assert {name: (settable[name].low, settable[name].high) for name in INPUTS} == INPUTS
    assert set(INPUTS) == set(settable)


def test_the_holograms_of_presets_are_those_of_the_add_on(addon):
    own = addon.patterns.OWN_INPUTS
    limits = {name: {each.name: (each.low, each.high) for each in sockets} for name, sockets in own.items()}
    limits.pop(addon.patterns.PICTURE)
    assert {name.upper(): inputs for name, inputs in PATTERNS.items()} == limits


@pytest.mark.night("test_it_adds_a_grating_with_the_request_and_the_look_of_the_file")
def test_undo_takes_it_back(scene):
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.grating.add_preset(preset="record", assign=False)
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert len(bpy.context.scene.natural_gratings.items) == 0
    bpy.ops.ed.redo()
    assert bpy.context.scene.natural_gratings.active().name == "Vinyl Record"


@pytest.mark.night("test_it_adds_a_grating_with_the_request_and_the_look_of_the_file")
def test_its_material_has_the_base_and_the_inputs(addon, scene, tmp_path, monkeypatch):
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE", str(tmp_path / "cache"))
    bpy.ops.grating.add_preset(preset="security_hologram", assign=False)
    grating = scene.natural_gratings.active()
    grating.delta_e, grating.coherence_um = 9.0, 4.0
    assert bpy.ops.grating.bake(directory=str(tmp_path / "bakes")) == {"FINISHED"}
    assert bpy.ops.grating.assign() == {"FINISHED"}
    material = grating.material
    skin = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    preset = read_preset("security_hologram")
    assert tuple(skin.inputs["Base Color"].default_value)[:3] == pytest.approx(preset.base_color)
    assert skin.inputs["Roughness"].default_value == pytest.approx(preset.base_roughness)
    (node,) = addon.material.diffraction_nodes(material)
    for name, value in preset.inputs.items():
        assert node.inputs[name].default_value == pytest.approx(value)
    pattern = addon.hologram_nodes.hologram_of(node)
    assert addon.hologram_nodes.pattern_of(pattern.node_tree) == "DOT_MATRIX"
    for name, value in preset.hologram.inputs.items():
        assert pattern.inputs[name].default_value == pytest.approx(value)
    assert pattern.inputs["Strength"].default_value == 1.0


def test_damaged_inputs_are_one_line(scene, grating):
    grating.look.inputs = json.dumps({"Roughness": 7})
    with pytest.raises(RuntimeError, match="waves: inputs: Roughness: cannot be 7; give a number from 0 to 1") as told:
        bpy.ops.grating.new_material()
    assert len(str(told.value).strip().splitlines()) == 1
    grating.look.inputs, grating.look.hologram = "", json.dumps({"pattern": "stars"})
    with pytest.raises(RuntimeError, match="waves: hologram: pattern: cannot be 'stars'; give one of dot_matrix"):
        bpy.ops.grating.new_material()
    grating.look.inputs = "{"
    with pytest.raises(RuntimeError, match="waves: its inputs: not JSON"):
        bpy.ops.grating.new_material()
    assert grating.material is None


def test_a_grating_without_a_preset_has_the_look_of_before(scene, grating, addon):
    bpy.ops.grating.new_material()
    skin = next(node for node in grating.material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    assert tuple(skin.inputs["Base Color"].default_value) == pytest.approx((0.012, 0.010, 0.009, 1.0))
    assert skin.inputs["Roughness"].default_value == pytest.approx(0.6)


@pytest.mark.night("test_it_adds_a_grating_with_the_request_and_the_look_of_the_file")
def test_the_batch_verb_bakes_a_preset(addon, scene, tmp_path, monkeypatch):
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE", str(tmp_path / "cache"))
    report = tmp_path / "facts.json"
    line = ["bake", "--preset", "cd", "--delta-e", "9", "--coherence-um", "4", "-o", str(tmp_path / "out")]
    assert addon.commands.execute([*line, "--json", str(report)]) == 0
    grating = bpy.context.scene.natural_gratings.active()
    assert (grating.name, grating.matter, grating.frame_kind) == ("CD", "ALUMINIUM", "RADIAL")
    assert grating.delta_e == 9.0 and json.loads(report.read_text())["coherence_um"] == pytest.approx(4)
