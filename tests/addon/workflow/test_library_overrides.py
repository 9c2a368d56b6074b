# SPDX-License-Identifier: GPL-3.0-or-later
"""An object that shows a grating in another file, linked into a scene: as it is, or with a library override."""

from types import SimpleNamespace

import bpy
import pytest

from tests.addon.conftest import select
from tests.addon.layout import Layout, context_of
from tests.addon.operators.test_every_button import press

KINDS = ("linked", "object", "collection", "material")
LINE = "Diffraction waves: linked from guest.blend; to adopt it, select its objects and use Object > Relations > Make "


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    return tmp_path_factory.mktemp("guest") / "guest.blend"


@pytest.fixture
def guest(scene, grating, made):
    """A file whose collection Show holds the object Guest, which shows the grating; another, empty file is open."""
    if not made.exists():
        bpy.ops.grating.assign()
        plane = bpy.context.object
        plane.name = plane.data.name = "Guest"
        held = bpy.data.collections.new("Show")
        scene.collection.children.link(held)
        for other in plane.users_collection:
            other.objects.unlink(plane)
        held.objects.link(plane)
        bpy.ops.wm.save_as_mainfile(filepath=str(made), copy=True)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    yield made
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)


def bring(file, kind):
    """Link Guest, make the library override, and add a sun. The object is selected."""
    scene = bpy.context.scene
    with bpy.data.libraries.load(str(file), link=True) as (_, into):
        if kind == "collection":
            into.collections = ["Show"]
        else:
            into.objects = ["Guest"]
    if kind == "collection":
        scene.collection.children.link(into.collections[0])
        into.collections[0].override_hierarchy_create(scene, bpy.context.view_layer, do_fully_editable=True)
        scene.collection.children.unlink(into.collections[0])
    else:
        scene.collection.objects.link(into.objects[0])
        if kind != "linked":
            into.objects[0].override_create(remap_local_usages=True)
    guest = guest_of_scene()
    if kind == "material":
        guest.data = guest.data.override_create(remap_local_usages=True)
        guest.material_slots[0].material = guest.active_material.override_create(remap_local_usages=True)
    add_lamps("SUN")
    select(guest)
    return guest


def guest_of_scene():
    return next(thing for thing in bpy.context.scene.objects if thing.name == "Guest")


def add_lamps(*kinds):
    for kind in kinds:
        bpy.context.scene.collection.objects.link(bpy.data.objects.new(kind, bpy.data.lights.new(kind, kind)))
    bpy.context.view_layer.update()


def own_grating(baked):
    made = bpy.context.scene.natural_gratings.items.add()
    made.name, made.bake_path = "own", str(baked)
    bpy.context.scene.natural_gratings.active_index = 0
    return made


def drawn(addon):
    layout = Layout()
    addon.panel.GratingPanel.draw(SimpleNamespace(layout=layout), context_of())
    return layout


@pytest.mark.parametrize("kind", KINDS)
def test_the_lamps_of_the_scene_light_it_and_the_panel_has_one_line(guest, addon, kind):
    thing = bring(guest, kind)
    scene = bpy.context.scene
    assert [lamp.data.type for lamp in addon.follow.followed_lamps(scene)] == ["SUN"] and scene["ng_key_0_on"]
    assert addon.material.shown_by(addon.group_properties.diffraction_groups()[0]) == [thing]
    layout = drawn(addon)
    assert layout.noted("INFO").startswith(LINE) and layout.noted("ERROR") == ""
    assert "grating.adopt" not in layout.operators


@pytest.mark.parametrize("kind", KINDS)
def test_more_lamps_than_the_linked_group_reads_are_in_that_line(guest, addon, kind):
    bring(guest, kind)
    add_lamps("POINT", "SPOT")
    assert "Diffraction waves: linked from guest.blend with only 1 of 3 lamps; to adopt it" in drawn(addon).noted(
        "INFO"
    )


@pytest.mark.short("[linked-True")
@pytest.mark.parametrize("is_owner", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_every_button_works_or_refuses_in_one_line(guest, addon, baked, kind, is_owner, capfd):
    bring(guest, kind)
    if is_owner:
        own_grating(baked)
    slow = ("show_me", "back_from_show", "add_snake", "add_shed_skin", "make_assets", "light_rig", "add_preset")
    operators = [cls.bl_idname for cls in addon.package.CLASSES if issubclass(cls, bpy.types.Operator)]
    faults = []
    for name in (each.removeprefix("grating.") for each in operators):
        if name not in slow:
            select(guest_of_scene())
            faults += [f"{name} {fault}" for fault in press(name, capfd)]
    assert faults == []


@pytest.mark.parametrize("kind", ["object", "collection", "material"])
def test_an_override_keeps_what_was_done_to_it_in_the_saved_file(guest, addon, baked, tmp_path, kind):
    thing = bring(guest, kind)
    own = own_grating(baked)
    assert bpy.ops.grating.assign() == {"FINISHED"}
    assert thing.active_material == own.material and own.material.library is None
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shot.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    thing, own = guest_of_scene(), bpy.context.scene.natural_gratings.active()
    assert thing.active_material == own.material
    select(thing)
    assert bpy.ops.grating.remove_diffraction() == {"FINISHED"}
    assert thing.active_material != own.material
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "shot.blend"))
    assert guest_of_scene().active_material != bpy.context.scene.natural_gratings.active().material


@pytest.mark.night("tests/addon/workflow/test_adopting.py")
@pytest.mark.parametrize("kind", KINDS)
def test_made_local_it_is_adopted(guest, addon, kind):
    bring(guest, kind)
    add_lamps("POINT", "SPOT")
    assert bpy.ops.object.make_local(type="ALL") == {"FINISHED"}
    assert bpy.ops.grating.adopt() == {"FINISHED"}
    (made,) = bpy.context.scene.natural_gratings.items
    assert made.own_group is not None and len(addon.skin.lamps_in(made.group)) == 3
    assert "Look: 0 objects" not in drawn(addon).labels
