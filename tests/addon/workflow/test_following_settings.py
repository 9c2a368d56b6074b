# SPDX-License-Identifier: GPL-3.0-or-later
"""A grating's settings reach its materials without another press of a button."""

import bpy
import pytest


@pytest.fixture
def nodes(scene, grating):
    """The nodes of the grating's group after Blender has evaluated the scene, as the panel requests it."""
    assert bpy.ops.grating.assign() == {"FINISHED"}

    def found():
        scene.update_tag()
        bpy.context.view_layer.update()
        return [node.as_pointer() for node in grating.group.nodes]

    return found


@pytest.mark.parametrize(("name", "value"), [("footprint", False), ("shadows", False)])
def test_a_setting_reaches_the_material_at_the_next_change(grating, nodes, name, value):
    """An unchanged setting rebuilds no nodes."""
    before = nodes()
    assert nodes() == before
    setattr(grating, name, value)
    without = nodes()
    assert without != before and nodes() == without
    bpy.ops.grating.assign()
    assert nodes() == without


def test_the_footprint_is_made_where_it_is_set(grating, nodes):
    def has_bumps():
        nodes()
        return "Footprint" in {node.node_tree.name for node in grating.group.nodes if node.type == "GROUP"}

    assert has_bumps()
    grating.footprint = False
    assert not has_bumps()


def test_of_scenes_that_share_a_material_the_present_ones_settings_count(addon, scene, grating, nodes):
    nodes()
    second = scene.copy()
    try:
        other = second.natural_gratings.items[0]
        assert other.group == grating.group
        other.footprint = False

        def counts(first):
            addon.making_materials.follow_settings(first)
            return "Footprint" in {node.node_tree.name for node in grating.group.nodes if node.type == "GROUP"}

        assert counts(scene) and not counts(second) and counts(scene)
    finally:
        bpy.data.scenes.remove(second)


def test_colours_of_another_working_space_are_told(addon, scene, grating, nodes, monkeypatch):
    nodes()
    assert addon.data_pictures.wrong_colours(scene) == []
    monkeypatch.setattr(addon.response, "working_space", lambda: "ACEScg")
    (told,) = addon.data_pictures.wrong_colours(scene)
    assert "its colours are of Rec.709, and the file's of ACEScg; bake or assign it again" in told
    assert bpy.ops.grating.assign() == {"FINISHED"}
    assert addon.data_pictures.wrong_colours(scene) == []


def test_an_exposure_with_which_eevee_dims_area_lamps_is_told(addon, scene, grating):
    scene.collection.objects.link(bpy.data.objects.new("Box", bpy.data.lights.new("Box", "AREA")))
    assert bpy.ops.grating.assign() == {"FINISHED"}
    for exposure, engine, lines in ((0.0, "eevee", 0), (-1.5, "eevee", 1), (-1.5, "cycles", 0)):
        scene.view_settings.exposure = exposure
        scene.render.engine = "CYCLES" if engine == "cycles" else addon.compat.eevee_engine()
        told = addon.data_pictures.wrong_colours(scene)
        assert len([line for line in told if "at an exposure other than 0" in line]) == lines
    scene.view_settings.exposure = 0.0


def test_a_linked_scene_keeps_its_own_lamps(addon, scene, grating, tmp_path, monkeypatch):
    """Its lamps were followed in its own file, and what is linked cannot be written."""
    path = tmp_path / "library.blend"
    bpy.data.libraries.write(str(path), {scene}, fake_user=True)
    with bpy.data.libraries.load(str(path), link=True) as (held, brought):
        brought.scenes = held.scenes
    assert sorted(each.library is None for each in bpy.data.scenes) == [False, True]
    followed = []
    monkeypatch.setattr(addon.lighting, "update_lamps", lambda each, **_: followed.append(each))
    addon.lighting.update_all_lamps()
    assert followed == [scene]
    bpy.data.libraries.remove(bpy.data.libraries[path.name])
