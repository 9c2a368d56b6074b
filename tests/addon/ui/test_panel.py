# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel as a path: what to do next, and which step is open."""

import importlib
import re
from types import SimpleNamespace

import bpy
import pytest

from devtools import ROOT
from tests.addon.layout import Layout, context_of


@pytest.fixture
def panel(addon):
    """Draws the panel of a new session; returns the layout."""
    addon.folds.forget_folds()

    def draw(folded=True, **context):
        layout = Layout(folded)
        given = context_of()
        vars(given).update(context)
        addon.panel.GratingPanel.draw(SimpleNamespace(layout=layout), given)
        assert not [label for label in layout.labels if "report this line" in label]
        return layout

    return draw


@pytest.fixture
def following(addon, scene):
    """Tells what to do next."""

    def tell(**context):
        given = context_of()
        vars(given).update(context)
        return addon.facts.next_step(given, scene.natural_gratings.active(), addon.facts.facts_of(given))

    return tell


def test_it_begins_with_a_picture_show_me_and_the_selected_mesh(scene, panel):
    layout = panel()
    assert layout.pictures == 1
    stickers = ["grating.add_sticker"] * 2
    begin = ["grating.show_me", "grating.add_preset", *stickers, "grating.import_height_map", "grating.make_assets"]
    assert layout.operators == begin
    assert "Corn Snake" in layout.labels


@pytest.mark.night("test_no_step_folds_by_itself_and_the_presets_stay")
def test_each_step_offers_the_next(scene, scan, following):
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    assert (following().step, following().operator) == ("Surface", "grating.bake")
    grating = scene.natural_gratings.active()
    grating.delta_e = 6.0
    bpy.ops.grating.bake()
    assert (following().step, following().text) == ("Look", "Assign to Plane")
    assert following(selected_objects=[]).operator == ""
    bpy.ops.grating.assign()
    assert following() is None
    grating.delta_e = 5.0
    assert (following().operator, following().text) == ("grating.bake", "Bake Again")


def test_a_grating_without_light_is_offered_a_rig(scene, grating, following):
    grating.lights = "LAMPS"
    bpy.ops.grating.assign()
    bpy.data.batch_remove(list(bpy.data.lights))
    assert (following().step, following().operator) == ("Light", "grating.light_rig")


def test_a_view_that_is_not_rendered_is_offered_to_switch(scene, grating, following):
    bpy.ops.grating.assign()
    view = next(area.spaces.active for area in bpy.data.screens["Layout"].areas if area.type == "VIEW_3D")
    view.shading.type = "SOLID"
    assert following(space_data=view).properties == {"action": "RENDERED"}
    view.shading.type = "RENDERED"
    assert following(space_data=view) is None


def test_a_mesh_without_a_uv_map_is_offered_its_axis(scene, grating, following):
    plane = bpy.context.active_object
    plane.data.uv_layers.remove(plane.data.uv_layers[0])
    offer = following()
    assert (offer.operator, offer.sentence) == ("grating.direction", "Plane: no UV map that gives a direction")
    bpy.ops.grating.direction(**offer.properties)
    assert following().operator == "grating.assign"


def test_only_the_large_button_is_pressed_without_a_dialog(scene, grating, panel):
    """Blender keeps one way of calling operators for the whole panel."""
    plane = bpy.context.active_object
    plane.data.uv_layers.remove(plane.data.uv_layers[0])
    contexts = panel(folded=False).contexts
    assert {contexts[name] for name in ("grating.bake", "grating.assign", "grating.vary")} == {"INVOKE_REGION_WIN"}


def test_only_the_present_step_is_open(scene, grating, panel):
    """A step that is done has a tick."""
    layout = panel()
    assert {"grating.new_material", "grating.comb"} <= set(layout.operators)
    assert not {"grating.choose_quality", "grating.lights"} & set(layout.operators)
    ticks = [label for label, icon in zip(layout.labels, layout.icons, strict=True) if icon == "CHECKMARK"]
    assert [label.partition(":")[0] for label in ticks] == ["Surface"]


def test_no_step_folds_by_itself_and_the_presets_stay(scene, grating, panel):
    """What folds under the pointer moves all buttons below it."""
    open_steps = {"grating.new_material", "grating.comb"}
    assert open_steps <= set(panel().operators)
    bpy.ops.grating.assign()
    layout = panel()
    assert open_steps <= set(layout.operators) and layout.operators.count("grating.light_rig") == 2
    grating.source, grating.asked = "sample:cd", "other settings"
    layout = panel()
    assert "grating.bake" in layout.operators and open_steps <= set(layout.operators)
    layout = panel(folded=False)
    assert {"grating.show_me", "grating.add_preset", "grating.make_assets"} <= set(layout.operators)
    assert layout.operators.count("grating.why_black") == 1 and layout.operators.count("grating.light_rig") == 2


def test_all_steps_can_be_opened(scene, scan, panel):
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    for matter in ("DIELECTRIC", "GOLD", "LAYERS"):
        scene.natural_gratings.active().matter = matter
        assert "grating.choose_quality" in panel(folded=False).operators
    scene.natural_gratings.active().delta_e = 6.0
    bpy.ops.grating.bake()
    bpy.ops.grating.assign()
    layout = panel(folded=False)
    assert {"grating.lights", "grating.why_black", "grating.needs"} <= set(layout.operators)
    assert layout.props.count("default_value") >= 4  # the dials of the material


def test_long_names_are_wrapped(scene, grating, panel):
    """At the width of 200 pixels that a new sidebar has, a line has 22 letters."""
    bpy.context.active_object.name = "A plane with a name longer than a line"
    bpy.ops.grating.assign()
    labels = [label for label in panel(folded=False, region=SimpleNamespace(width=200)).labels if "with a" in label]
    assert labels and all(len(label) <= 22 for label in labels)


def test_a_narrow_sidebar_cuts_no_button(addon):
    """At the width of a new sidebar in Blender 5.2 buttons stand side by side, at that of Blender 4.5 in a column."""
    layout = SimpleNamespace(row=lambda align: "row", column=lambda align: "column")
    texts = ("Assign", "Add", "Remove")
    assert [addon.notes.side_by_side(layout, context_of(width), *texts) for width in (284, 200)] == ["row", "column"]


def test_the_plus_imports_a_scan_too(addon, scene):
    layout = Layout()
    addon.panel.SampleMenu.draw(SimpleNamespace(layout=layout), context_of())
    assert layout.operators.index("grating.import_height_map") < layout.operators.index("grating.add_grating")


def test_a_surface_tells_its_period_in_lines(scene, scan, panel):
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    assert "Surface: 500 nm, 2000 lines/mm" in panel().labels


def test_a_dial_that_nodes_drive_says_so(scene, grating, panel, addon):
    bpy.ops.grating.assign()
    (node,) = addon.material.diffraction_nodes(grating.material)
    value = grating.material.node_tree.nodes.new("ShaderNodeValue")
    grating.material.node_tree.links.new(value.outputs[0], node.inputs["Strength"])
    assert "Strength: by nodes" in panel(folded=False).labels


@pytest.mark.parametrize("quality", ["DRAFT", "GOOD", "EXACT"])
def test_a_quality_sets_the_bake(scene, grating, addon, quality):
    bpy.ops.grating.choose_quality(quality=quality)
    assert addon.grating.quality_of(grating) == quality
    grating.delta_e = 2.0
    assert addon.grating.quality_of(grating) == ""


def test_the_surface_offers_the_pictures_that_it_can_show(scene, grating, scan, panel):
    """A bake without a scan has a chart alone, and a scan without a bake has none."""
    assert panel(folded=False).operators.count("grating.show_picture") == 1
    scene.natural_gratings.items.clear()
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    assert panel(folded=False).operators.count("grating.show_picture") == 2


def test_walks_name_modules_buttons_and_folds_that_exist(addon):
    """The walks need a Blender with a window, so the nightly suite runs them."""
    text = "".join(path.read_text() for path in (ROOT / "devtools" / "window").glob("*.py"))
    for module, name in re.findall(r'part\("([\w.]+)"\)\.(\w+)', text):
        assert hasattr(importlib.import_module(f"{addon.package.__name__}.{module}"), name)
    assert set(re.findall(r"bpy\.ops\.grating\.(\w+)", text)) <= set(dir(bpy.ops.grating))
    assert set(re.findall(r"folds\.(\w+)", text)) <= set(addon.folds.Folds.__annotations__)
