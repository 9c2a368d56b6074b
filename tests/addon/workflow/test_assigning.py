# SPDX-License-Identifier: GPL-3.0-or-later
"""Assign, Add and Remove on artists' objects: shared materials, several slots, linked objects, curves."""

from itertools import pairwise

import bpy
import pytest

from tests.addon.conftest import reports, select


def paint(name, addon):
    """An artist's material."""
    material = bpy.data.materials.new(name)
    addon.compat.enable_nodes(material)
    return material


def second_object(scene, mesh=None):
    """A second plane, unselected, with its own mesh or the given one."""
    thing = bpy.data.objects.new("Second", mesh or bpy.context.object.data.copy())
    scene.collection.objects.link(thing)
    return thing


def shows(material, addon) -> bool:
    """Whether a linked, unmuted Diffraction node feeds a Material Output."""
    nodes = addon.material.diffraction_nodes(material)
    ends = [link.to_node.type for node in nodes for link in node.outputs["Shader"].links if not node.mute]
    return "OUTPUT_MATERIAL" in ends


def test_nodes_stand_beside_each_other(scene, grating, addon):
    """And the Diffraction node is wide enough for the names of its inputs."""
    plane = bpy.context.object
    bpy.ops.grating.assign()
    painted = paint("Paint", addon)
    for material in (plane.active_material, painted):
        plane.active_material = material
        bpy.ops.grating.add_diffraction()
        nodes = sorted(material.node_tree.nodes, key=lambda node: node.location.x)
        assert [node.width for node in addon.material.diffraction_nodes(material)] == [200]
        assert all(one.location.x + one.width < other.location.x for one, other in pairwise(nodes))


def test_remove_leaves_what_shares_the_material(scene, grating, addon):
    plane, second = bpy.context.object, second_object(scene)
    shared = paint("Paint", addon)
    for thing in (plane, second):
        thing.data.materials.append(shared)
    bpy.ops.grating.add_diffraction()
    assert bpy.ops.grating.remove_diffraction() == {"FINISHED"}
    assert second.active_material == shared and shows(shared, addon)
    own = plane.active_material
    assert own != shared and not addon.material.diffraction_nodes(own)
    assert not bpy.ops.grating.remove_diffraction.poll()


def test_remove_leaves_what_shares_the_mesh(scene, grating, addon):
    plane = bpy.context.object
    second = second_object(scene, plane.data)
    plane.data.materials.append(paint("Paint", addon))
    bpy.ops.grating.add_diffraction()
    bpy.ops.grating.remove_diffraction()
    assert shows(second.active_material, addon)
    assert not addon.material.diffraction_nodes(plane.active_material)


def test_remove_on_all_that_share_makes_no_copy(scene, grating, addon):
    plane, second = bpy.context.object, second_object(scene)
    shared = paint("Paint", addon)
    for thing in (plane, second):
        thing.data.materials.append(shared)
    bpy.ops.grating.add_diffraction()
    select(plane, second)
    bpy.ops.grating.remove_diffraction()
    assert plane.active_material == second.active_material == shared
    assert not addon.material.diffraction_nodes(shared)
    assert len(bpy.data.materials) == 1


def test_remove_gives_back_what_assign_replaced(scene, grating, addon):
    plane, second = bpy.context.object, second_object(scene)
    before = paint("Paint", addon)
    plane.data.materials.append(before)
    select(plane, second)
    bpy.ops.grating.assign()
    bpy.ops.grating.assign()
    assert plane.active_material == second.active_material == grating.material
    # The sidebar lists these on the tab Item, without an extension's own.
    assert not [key for key in plane.keys() if key.startswith("ng_")]  # noqa: SIM118  objects are no dicts
    select(plane)
    bpy.ops.grating.remove_diffraction()
    assert plane.active_material == before
    assert second.active_material == grating.material and shows(grating.material, addon)
    select(second)
    bpy.ops.grating.remove_diffraction()
    assert second.active_material is None
    assert {each.slot for each in second.natural_gratings_replaced} == {-1}


@pytest.mark.parametrize("gone", ["grating removed", "another material made"])
def test_remove_gives_back_also_where_the_grating_has_left_its_material(scene, grating, addon, gone):
    plane = bpy.context.object
    before = paint("Paint", addon)
    plane.data.materials.append(before)
    bpy.ops.grating.assign()
    if gone == "grating removed":
        bpy.ops.grating.remove()
    else:
        bpy.ops.grating.new_material()
    bpy.ops.grating.remove_diffraction()
    assert plane.active_material == before


def test_remove_keeps_the_gratings_own_material_for_the_next_object(scene, grating, addon):
    """An artist put it into a slot by hand."""
    bpy.ops.grating.new_material()
    plane = bpy.context.object
    plane.data.materials.append(grating.material)
    bpy.ops.grating.remove_diffraction()
    assert plane.active_material != grating.material
    assert not addon.material.diffraction_nodes(plane.active_material)
    bpy.ops.grating.assign()
    assert plane.active_material == grating.material and shows(grating.material, addon)


@pytest.mark.parametrize("fault", ["deleted", "unlinked", "muted", "all nodes deleted"])
def test_assign_mends_its_material(scene, grating, addon, fault):
    bpy.ops.grating.assign()
    tree = grating.material.node_tree
    (node,) = addon.material.diffraction_nodes(grating.material)
    node.inputs["Rotation"].default_value = 0.3
    if fault == "deleted":
        tree.nodes.remove(node)
    elif fault == "unlinked":
        tree.links.remove(node.outputs["Shader"].links[0])
    elif fault == "muted":
        node.mute = True
    else:
        tree.nodes.clear()
    bpy.ops.grating.assign()
    shown = bpy.context.object.active_material
    assert shown == grating.material and shows(shown, addon)
    (node,) = addon.material.diffraction_nodes(shown)
    assert node.node_tree == grating.group
    if fault in {"unlinked", "muted"}:
        assert node.inputs["Rotation"].default_value == pytest.approx(0.3)


def test_assign_sees_diffraction_behind_an_artists_nodes(scene, grating, addon):
    bpy.ops.grating.assign()
    tree = grating.material.node_tree
    (node,) = addon.material.diffraction_nodes(grating.material)
    mix = tree.nodes.new("ShaderNodeMixShader")
    output = node.outputs["Shader"].links[0].to_node
    tree.links.new(node.outputs["Shader"], mix.inputs[1])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    bpy.ops.grating.assign()
    assert addon.material.diffraction_nodes(grating.material) == [node]
    assert output.inputs["Surface"].links[0].from_node == mix


def test_assign_says_which_slot_it_replaced(scene, grating, addon, capfd):
    plane = bpy.context.object
    names = ("Skin", "Belly", "Eye")
    for name in names:
        plane.data.materials.append(paint(name, addon))
    said = reports(bpy.ops.grating.assign, capfd)
    assert "slot 1 of 3 (Skin) was replaced; Add to Materials changes all slots" in said
    assert [slot.material.name for slot in plane.material_slots] == ["Diffraction waves", "Belly", "Eye"]
    assert "was replaced" not in reports(bpy.ops.grating.assign, capfd)


def test_shadows_are_chosen_anew_at_each_assign(scene, grating, addon):
    def labels():
        return {node.label for node in grating.group.nodes} | {node.bl_idname for node in grating.group.nodes}

    bpy.ops.grating.assign()
    traced = labels()
    grating.shadows = False
    bpy.ops.grating.assign()
    assert ("ShaderNodeRaycast" in traced) == addon.compat.HAS_RAYCAST
    assert "ShaderNodeRaycast" not in labels()
    grating.shadows = True
    bpy.ops.grating.assign()
    assert labels() == traced


def test_add_serves_all_slots_that_faces_show(scene, grating, addon):
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    materials = [paint(name, addon) for name in ("One", "Two", "Unseen")]
    for material in materials:
        cube.data.materials.append(material)
    cube.data.polygons[5].material_index = 1
    assert bpy.ops.grating.add_diffraction() == {"FINISHED"}
    assert [shows(material, addon) for material in materials] == [True, True, False]
    assert bpy.ops.grating.remove_diffraction() == {"FINISHED"}
    assert not any(addon.material.diffraction_nodes(material) for material in materials)


def without_output(material):
    nodes = material.node_tree.nodes
    nodes.remove(next(node for node in nodes if node.type == "OUTPUT_MATERIAL"))


def test_add_that_fails_on_its_second_material_has_changed_nothing(scene, grating, addon):
    first, second = paint("First", addon), paint("Second", addon)
    without_output(second)
    plane, other = bpy.context.object, second_object(scene)
    plane.data.materials.append(first)
    other.data.materials.append(second)
    select(plane, other)
    with pytest.raises(RuntimeError, match="Second: it has no Material Output"):
        bpy.ops.grating.add_diffraction()
    assert not addon.material.diffraction_nodes(first)
    assert grating.group is None and not bpy.data.node_groups and not bpy.data.images


@pytest.fixture
def library(scene, addon, tmp_path):
    """A file with a cube that has a material and a cube without one."""
    path = tmp_path / "library.blend"
    for name, material in (("Painted", paint("Foreign", addon)), ("Bare", None)):
        bpy.ops.mesh.primitive_cube_add()
        cube = bpy.context.object
        cube.name = cube.data.name = name
        if material:
            cube.data.materials.append(material)
    bpy.data.libraries.write(str(path), {bpy.data.objects["Painted"], bpy.data.objects["Bare"]})
    for name in ("Painted", "Bare"):
        bpy.data.objects.remove(bpy.data.objects[name])
    unused = [each for data in (bpy.data.meshes, bpy.data.materials) for each in data if each.users == 0]
    bpy.data.batch_remove(unused)
    return path


def link(scene, path, name):
    with bpy.data.libraries.load(str(path), link=True) as (_, into):
        into.objects = [name]
    scene.collection.objects.link(into.objects[0])
    return into.objects[0]


@pytest.mark.parametrize("button", ["assign", "add_diffraction"])
def test_a_linked_object_is_one_line_with_the_remedy(scene, grating, addon, library, button):
    linked = link(scene, library, "Painted")
    select(linked)
    with pytest.raises(RuntimeError, match=r"Painted: linked from .*library.blend; use Object > Library Override"):
        getattr(bpy.ops.grating, button)()
    assert linked.active_material.name == "Foreign" and grating.group is None


def test_an_override_takes_the_material_and_gives_it_back(scene, grating, addon, library):
    override = link(scene, library, "Painted").override_create(remap_local_usages=True)
    select(override)
    assert bpy.ops.grating.assign() == {"FINISHED"}
    assert override.active_material == grating.material
    assert override.data.library is not None
    assert override.data.materials[0].name == "Foreign"
    assert bpy.ops.grating.remove_diffraction() == {"FINISHED"}
    assert override.active_material.name == "Foreign"


def test_a_linked_mesh_without_a_slot_is_one_line(scene, grating, addon, library):
    override = link(scene, library, "Bare").override_create(remap_local_usages=True)
    select(override)
    with pytest.raises(RuntimeError, match="Bare: its mesh Bare is linked from another file and has no material slot"):
        bpy.ops.grating.assign()


def test_a_linked_material_is_refused_before_any_change(scene, grating, addon, library):
    foreign = link(scene, library, "Painted").data.materials[0]
    plane = bpy.data.objects["Plane"]
    other = second_object(scene, plane.data.copy())
    own = paint("Own", addon)
    plane.data.materials.append(own)
    other.data.materials.append(foreign)
    select(plane, other)
    with pytest.raises(RuntimeError, match="Foreign: linked from .*; use Make Local"):
        bpy.ops.grating.add_diffraction()
    assert not addon.material.diffraction_nodes(own)


@pytest.mark.night("test_assign_mends_its_material")
@pytest.mark.parametrize(
    ("kind", "word"), [("curve.primitive_bezier_circle_add", "curve"), ("object.text_add", "text"),
                       ("object.metaball_add", "metaball"), ("surface.primitive_nurbs_surface_sphere_add", "surface"),
                       ("object.curves_empty_hair_add", "hair")]
)  # fmt: skip
def test_what_is_no_mesh_is_named_with_the_remedy(scene, grating, addon, capfd, kind, word):
    plane = bpy.context.object
    if word == "hair":
        thing = bpy.data.objects.new("Hair", bpy.data.hair_curves.new("Hair"))
        scene.collection.objects.link(thing)
    else:
        room, name = kind.split(".")
        getattr(getattr(bpy.ops, room), name)()
        thing = bpy.context.object
    select(plane, thing)
    assert f"{thing.name}: a {word} cannot show a grating; use Object > Convert > Mesh" in reports(
        bpy.ops.grating.assign, capfd
    )
    select(thing)
    with pytest.raises(RuntimeError, match=f"a {word} cannot show a grating"):
        bpy.ops.grating.assign()


def test_a_mesh_in_edit_mode_is_left_alone(scene, grating, addon):
    """The command line too, which has no button to grey out."""
    plane = bpy.context.object
    bpy.ops.object.mode_set(mode="EDIT")
    try:
        with pytest.raises(RuntimeError, match="Switch to Object Mode first"):
            bpy.ops.grating.assign()
        with pytest.raises(Exception, match="Plane: in Edit Mode; switch to Object Mode first"):
            addon.assigning.assign_to_meshes(scene, [plane])
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
    assert not plane.material_slots and grating.material is None and not bpy.data.materials
