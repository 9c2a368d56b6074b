# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffraction materials that are appended, pasted or linked, and gratings that are imported twice."""

from types import SimpleNamespace

import bpy
import pytest

from tests.addon.conftest import reports, select
from tests.addon.layout import Layout, context_of

REMEDY = "Diffraction waves: linked from guest.blend; to adopt it, select its objects and use Object > Relations > "


@pytest.fixture(scope="module")
def guest(tmp_path_factory):
    return tmp_path_factory.mktemp("guest") / "guest.blend"


@pytest.fixture
def file(scene, grating, guest):
    """A file whose object Guest shows the grating, with unusual settings; another, empty file is open."""
    if not guest.exists():
        grating.lights, grating.shadows, grating.footprint = "LAMPS", False, False
        bpy.ops.grating.assign()
        bpy.ops.grating.direction(kind="AXIS", axis="Y")
        bpy.context.object.name = "Guest"
        bpy.ops.wm.save_as_mainfile(filepath=str(guest), copy=True)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    yield guest
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def bring(file, link=False):
    (bpy.ops.wm.link if link else bpy.ops.wm.append)(directory=f"{file}/Object/", filename="Guest")


def gratings():
    return bpy.context.scene.natural_gratings.items


def drawn(addon):
    layout = Layout()
    addon.panel.GratingPanel.draw(SimpleNamespace(layout=layout), context_of())
    return layout


def test_an_appended_material_becomes_a_grating(file, addon, capfd):
    assert not bpy.ops.grating.adopt.poll()
    bring(file)
    layout = drawn(addon)
    assert "Not in the list: Diffraction waves" in layout.noted("INFO") and "grating.adopt" in layout.operators
    assert "Diffraction waves: is now the grating waves" in reports(bpy.ops.grating.adopt, capfd)
    (made,) = gratings()
    shown = made.lights, made.shadows, made.footprint, made.frame_kind, made.frame_axis
    assert shown == ("LAMPS", False, False, "AXIS", "Y")
    assert made.baked_file().is_file() and made.group.name == made.material.name == "Diffraction waves"
    layout = drawn(addon)
    assert "Look: 1 object" in layout.labels and "grating.adopt" not in layout.operators
    made.name = "scales"
    assert made.group.name == made.material.name == "Diffraction scales"
    bpy.ops.grating.lights(lights="REST")
    assert addon.group_properties.lights_of(made.group) == "REST"


def test_its_bake_comes_from_its_pictures(file):
    bring(file)
    for image in bpy.data.images:
        image.filepath_raw = "//lost/waves.exr"
    bpy.ops.grating.adopt()
    assert gratings()[0].baked_file().is_file()


def blocks():
    """The names of node groups and pictures. Before Blender 5.0 a replaced group is only emptied
    (compat.remove_replaced)."""
    names = [block.name for kind in (bpy.data.node_groups, bpy.data.images) for block in kind]
    return sorted(name for name in names if not name.startswith("Replaced"))


def test_a_pasted_copy_follows_its_grating(file, addon, capfd):
    """By Ctrl-C and Ctrl-V in one file. Only the material is then a copy, with its own inputs."""
    bring(file)
    bpy.ops.grating.adopt()
    held = blocks()
    select(bpy.data.objects["Guest"])
    bpy.ops.view3d.copybuffer()
    bpy.ops.view3d.pastebuffer()
    copy = bpy.data.objects["Guest.001"]
    (node,) = addon.material.diffraction_nodes(copy.active_material)
    node.inputs["Strength"].default_value = 0.5
    assert node.node_tree != gratings()[0].group
    assert "Diffraction waves.001: follows waves" in reports(bpy.ops.grating.adopt, capfd)
    (made,) = gratings()
    (node,) = addon.material.diffraction_nodes(copy.active_material)
    assert node.node_tree == made.group and node.inputs["Strength"].default_value == 0.5
    assert blocks() == held
    assert "Look: 2 objects" in drawn(addon).labels


def test_a_linked_material_says_how_to_make_it_local(file, addon):
    bring(file, link=True)
    layout = drawn(addon)
    assert REMEDY in layout.noted("INFO") and "grating.adopt" not in layout.operators
    with pytest.raises(RuntimeError, match=REMEDY):
        bpy.ops.grating.adopt()
    assert len(gratings()) == 0
    select(bpy.data.objects["Guest"])
    bpy.ops.object.make_local(type="ALL")
    assert bpy.ops.grating.adopt() == {"FINISHED"}
    assert gratings()[0].group.library is None


def test_a_removed_grating_can_be_adopted_again(scene, grating, addon):
    bpy.ops.grating.assign()
    group, material = grating.group, grating.material
    bpy.ops.grating.remove()
    bpy.ops.grating.adopt()
    (made,) = gratings()
    assert (made.name, made.group, made.material) == ("waves", group, material)


def test_another_scenes_grating_is_offered_where_an_object_shows_it(scene, grating, addon):
    bpy.ops.grating.assign()
    other = bpy.data.scenes.new("Other")
    assert addon.material.strays(other) == []
    other.collection.objects.link(bpy.context.object)
    assert addon.material.strays(other) == [grating.group]
    addon.adopting.adopt(other)
    (made,) = other.natural_gratings.items
    assert made.group == grating.group and addon.material.strays(scene) == []
    bpy.data.scenes.remove(other)


def test_materials_of_osl_and_unused_ones_are_not_offered(scene, grating, addon, baked):
    scene.render.engine = "CYCLES"  # Blender compiles scripts only under Cycles
    addon.skin.group_around("Unused", addon.making_materials.response_of(baked))
    bpy.context.object.data.materials.append(addon.making_osl_references.reference_from_bake(scene, baked))
    assert addon.material.strays(scene) == []


@pytest.mark.parametrize(("count", "line"), [
    (0, "On no object"), (1, "On: A"), (2, "On: A and B"), (3, "On: A, B and C"), (5, "On: A, B and 3 more"),
])  # fmt: skip
def test_the_line_of_objects(addon, count, line):
    assert addon.material.on_objects([SimpleNamespace(name=name) for name in "ABCDE"[:count]]) == line


def test_objects_are_found_behind_groups_and_slots(scene, grating, addon):
    """In a group in a material, in an object's own slot, and on a curve, but not where another material hides it."""
    bpy.ops.grating.assign()
    plane, data = bpy.context.object, bpy.data
    outer = data.node_groups.new("Outer", "ShaderNodeTree")
    outer.nodes.new("ShaderNodeGroup").node_tree = grating.group
    wrapped = data.materials.new("Wrapped")
    addon.compat.enable_nodes(wrapped)
    wrapped.node_tree.nodes.new("ShaderNodeGroup").node_tree = outer
    curve = data.objects.new("Curve", data.curves.new("Curve", "CURVE"))
    curve.data.materials.append(wrapped)
    hidden = data.objects.new("Hidden", plane.data)
    hidden.material_slots[0].link = "OBJECT"
    hidden.material_slots[0].material = data.materials.new("Paint")
    assert addon.material.shown_by(grating.group) == [curve, plane]
    assert addon.directing.meshes_that_show(grating.group) == [plane]


def add_sample(capfd):
    return reports(lambda: bpy.ops.grating.import_height_map(filepath="sample:flat"), capfd)


def test_a_sample_that_is_in_the_list_is_selected(scene, capfd):
    add_sample(capfd)
    bpy.ops.grating.import_height_map(filepath="sample:cd")
    assert "Flat: it is in the list already, and now selected" in add_sample(capfd)
    assert [each.name for each in gratings()] == ["Flat", "CD"]
    assert scene.natural_gratings.active_index == 0


def test_the_same_scan_with_other_settings_is_another_grating(scene, scan):
    for size in (4, 4, 5):
        bpy.ops.grating.import_height_map(filepath=str(scan), size_um=size, height_nm=100)
    assert [each.name for each in gratings()] == ["waves", "waves.001"]
    gratings()[1].delta_e = 3.0  # for comparison
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=5, height_nm=100)
    assert len(gratings()) == 3
