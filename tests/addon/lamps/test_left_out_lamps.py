# SPDX-License-Identifier: GPL-3.0-or-later
"""Leaving lamps out of the diffraction and keeping them in: which lamps count, what groups hold, and refusals."""

from types import SimpleNamespace

import bpy
import pytest

from tests.addon.layout import Layout, context_of, listed_properties

from .conftest import add_lamp, equal_lamps


def count(name):
    assert bpy.ops.grating.count_lamp(lamp=name) == {"FINISHED"}


@pytest.fixture
def followed(addon, lit):
    """A function that returns the names of the lamps that light the diffraction and of the lamps that are left out."""

    def names():
        counted, left_out = addon.follow.followed_lamps(lit), addon.follow.left_out_lamps(lit)
        return [lamp.name for lamp in counted], [lamp.name for lamp in left_out]

    return names


def test_a_lamp_is_left_out_and_kept_in_again(addon, lit, followed):
    equal_lamps(lit, 3)
    addon.lighting.update_lamps(lit)
    count("L1")
    assert followed() == (["L0", "L2"], ["L1"])
    assert listed_properties(bpy.data.objects["L1"]) == []
    count("L1")
    assert followed() == (["L0", "L2", "L1"], [])
    assert bpy.data.objects["L1"].natural_gratings_counts == "AUTO", "the extension chooses again"


def test_the_choice_belongs_to_the_object(addon, lit, followed):
    """Of two lamps that share their data, one is left out. Its duplicate is left out too."""
    (lamp,) = equal_lamps(lit, 1)
    twin = lamp.copy()
    twin.name = "Twin"
    lit.collection.objects.link(twin)
    addon.lighting.update_lamps(lit)
    count("Twin")
    assert followed() == (["L0"], ["Twin"])
    lit.collection.objects.link(twin.copy())
    addon.lighting.update_lamps(lit)
    assert followed() == (["L0"], ["Twin", "Twin.001"])


def test_without_a_name_it_is_the_active_lamp(addon, lit, followed):
    (lamp,) = equal_lamps(lit, 1)
    addon.lighting.update_lamps(lit)
    with pytest.raises(RuntimeError, match="no lamp is active; make the lamp the active object"):
        bpy.ops.grating.count_lamp()
    bpy.context.view_layer.objects.active = lamp
    count("")
    assert followed() == ([], ["L0"])
    held = bpy.ops.grating.count_lamp.get_rna_type().properties["lamp"]
    assert held.is_skip_save, "else a menu repeats the lamp of the last call"


@pytest.mark.night("test_the_panel_lists_left_out_lamps_with_their_button")
@pytest.mark.parametrize("lights", ["LAMPS", "REST", "ALL"])
def test_groups_lose_a_lamp_that_is_left_out(addon, lit, grating, lights):
    """With Lamps Only the group has the nodes of two lamps. With Lamps and World it has few more nodes than these, to
    see nothing of the third."""
    equal_lamps(lit, 2)
    bpy.ops.grating.lights(lights=lights)
    addon.lighting.update_lamps(lit)
    group = lit.natural_gratings.active().group
    two = len(group.nodes)
    add_lamp(lit, "Rim")
    addon.lighting.update_lamps(lit)
    three = len(group.nodes)
    assert three > two
    count("Rim")
    assert addon.group_properties.lamps_in(group) == [False, False]
    more = len(group.nodes) - two
    assert 0 < more < three - two if lights == "REST" else more == 0
    assert addon.group_properties.left_out_in(group) == (lights == "REST")
    bpy.ops.grating.lights(lights="LAMPS" if lights == "REST" else "REST")
    assert addon.group_properties.left_out_in(group) == 1


def test_a_dim_lamp_is_kept_in(lit, ranked, eight_lamps):
    """Among nine lamps, in place of the least of the other eight."""
    for k, lamp in enumerate(equal_lamps(lit, 8)):
        lamp.data.energy = 100.0 + k
    add_lamp(lit, "Dim", energy=0.1)
    assert "Dim" not in ranked()
    count("Dim")
    assert set(ranked()) == {*(f"L{k}" for k in range(1, 8)), "Dim"}
    bpy.data.objects["Dim"].hide_render = True
    assert "Dim" in ranked()
    count("Dim")
    assert set(ranked()) == {f"L{k}" for k in range(8)}


def test_a_lamp_that_is_left_out_makes_room(addon, lit, ranked, followed, eight_lamps):
    equal_lamps(lit, 8)
    add_lamp(lit, "Dim", energy=0.1)
    ranked()
    count("L3")
    assert set(ranked()) == {*(f"L{k}" for k in range(8) if k != 3), "Dim"}
    assert followed()[1] == ["L3"]
    told = addon.lighting.warnings_about(lit, bpy.context.evaluated_depsgraph_get())
    assert not any("at most 8 lamps" in line for line in told)


def test_a_ninth_lamp_cannot_be_kept_in(lit, ranked, eight_lamps):
    for lamp in equal_lamps(lit, 8):
        lamp.natural_gratings_counts = "KEPT"
    dim = add_lamp(lit, "Dim", energy=0.1)
    ranked()
    with pytest.raises(RuntimeError, match="Dim: 8 other lamps are kept in; leave one of them out first"):
        bpy.ops.grating.count_lamp(lamp="Dim")
    assert dim.natural_gratings_counts == "AUTO" and "Dim" not in ranked()


def test_undo_and_redo(addon, lit, followed):
    equal_lamps(lit, 2)
    addon.lighting.update_lamps(lit)
    bpy.ops.ed.undo_push(message="before")
    count("L1")
    bpy.ops.ed.undo_push(message="left out")

    def shown():
        scene = bpy.context.scene
        counted, left_out = addon.follow.followed_lamps(scene), addon.follow.left_out_lamps(scene)
        return [lamp.name for lamp in counted], [lamp.name for lamp in left_out]

    assert shown() == (["L0"], ["L1"])
    bpy.ops.ed.undo()
    assert shown() == (["L0", "L1"], []) and bpy.data.objects["L1"].natural_gratings_counts == "AUTO"
    bpy.ops.ed.redo()
    assert shown() == (["L0"], ["L1"])


def test_a_deleted_lamp_leaves_no_properties(addon, lit, followed):
    equal_lamps(lit, 2)
    addon.lighting.update_lamps(lit)
    count("L0")
    assert "ng_key_8_place" in lit
    bpy.data.objects.remove(bpy.data.objects["L0"])
    bpy.context.view_layer.update()
    assert followed() == (["L1"], []) and "ng_key_8_place" not in lit


def test_a_linked_lamp_is_refused(addon, lit, tmp_path):
    """Also one with a library override, whose new properties Blender does not save. The choice of its file counts."""
    path = tmp_path / "lamps.blend"
    rim = bpy.data.objects.new("Rim", bpy.data.lights.new("Rim", "POINT"))
    rim.natural_gratings_counts = "LEFT_OUT"
    held = bpy.data.collections.new("Rims")
    held.objects.link(rim)
    bpy.data.libraries.write(str(path), {held}, fake_user=True)
    bpy.data.objects.remove(rim)
    bpy.data.collections.remove(held)
    with bpy.data.libraries.load(str(path), link=True) as (_, into):
        into.collections = ["Rims"]
    lit.collection.children.link(into.collections[0])
    addon.lighting.update_lamps(lit)
    assert [lamp.name for lamp in addon.follow.left_out_lamps(lit)] == ["Rim"]
    for _ in range(2):
        with pytest.raises(RuntimeError, match="Rim: linked from another file; leave it out in that file, or use"):
            bpy.ops.grating.count_lamp(lamp="Rim")
        into.collections[0].override_hierarchy_create(lit, bpy.context.view_layer)
    bpy.data.batch_remove([each for each in bpy.data.objects if each.name == "Rim"])
    bpy.data.batch_remove(list(bpy.data.libraries))


def test_the_panel_lists_left_out_lamps_with_their_button(addon, lit):
    equal_lamps(lit, 2)
    bpy.ops.grating.lights(lights="LAMPS")
    for name in ("L0", "L1"):
        count(name)
    layout = Layout(folded=False)
    addon.panel.GratingPanel.draw(SimpleNamespace(layout=layout), context_of())
    assert layout.operators.count("grating.count_lamp") == 2 and {"L0", "L1"} <= set(layout.labels)
    assert "All lamps are left out, so the" in layout.noted("INFO")
    bpy.ops.grating.lights(lights="ALL")
    layout = Layout(folded=False)
    addon.panel.GratingPanel.draw(SimpleNamespace(layout=layout), context_of())
    assert "grating.count_lamp" not in layout.operators and "L0" in layout.labels


def test_why_is_it_black_names_a_lamp_that_is_left_out(addon, lit, followed):
    equal_lamps(lit, 1)
    bpy.ops.grating.lights(lights="LAMPS")
    count("L0")
    (cause, *_) = addon.finding_causes.findings(bpy.context).causes
    assert "L0 is left out of the diffraction" in cause.sentence
    bpy.ops.grating.mend_cause(action="SHOW_LAMPS")
    assert followed() == (["L0"], [])


def test_a_diffraction_lamp_needs_no_lamp_that_counts(addon, lit):
    equal_lamps(lit, 1)
    count("L0")
    assert bpy.ops.grating.add_diffraction_lamp() == {"FINISHED"}
