# SPDX-License-Identifier: GPL-3.0-or-later
"""The menu Object > Natural Gratings: which operators it has, and that each can be called."""

from types import SimpleNamespace

import bpy
import pytest

from tests.addon.layout import Layout, context_of

# What an artist does by the panel, so that the keyboard must do it too.
WORK = {
    "import_height_map", "bake", "needs", "assign", "add_diffraction", "remove_diffraction", "mend", "vary",
    "hologram", "add_sticker", "paint", "unpaint", "direction", "comb", "unwrap", "show_direction", "light_rig",
    "lights", "count_lamp", "add_diffraction_lamp", "why_black", "manual",
}  # fmt: skip


@pytest.fixture
def entries(addon, scene):
    """The names of the menu's operators, without "grating."."""
    layout = Layout()
    addon.object_menu.ObjectMenu.draw(SimpleNamespace(layout=layout), context_of())
    assert not layout.labels
    return [name.removeprefix("grating.") for name in layout.operators]


def test_it_has_the_work_of_an_artist(entries):
    assert set(entries) == WORK and len(entries) == len(WORK)


def test_each_entry_exists_and_is_grey_with_a_reason_or_can_be_pressed(entries):
    """Blender raises if an operator or its poll is wrong."""
    for name in entries:
        operator = getattr(bpy.ops.grating, name)
        assert operator.get_rna_type().name
        operator.poll()


def test_a_submenu_offers_an_enumeration(addon):
    for entry in (each for group in addon.object_menu._GROUPS for each in group if isinstance(each, tuple)):
        operator, name = entry
        described = getattr(bpy.ops.grating, operator.bl_idname.removeprefix("grating.")).get_rna_type()
        assert described.properties[name].type == "ENUM"


def test_it_is_in_the_object_menu(addon):
    layout = Layout()
    menus = []
    layout.menu = lambda name, **_: menus.append(name)
    (entry,) = [
        each
        for each in bpy.types.VIEW3D_MT_object.draw._draw_funcs
        if each.__module__.startswith(addon.package.__name__)
    ]
    entry(SimpleNamespace(layout=layout), bpy.context)
    assert menus == ["GRATING_MT_object"]
