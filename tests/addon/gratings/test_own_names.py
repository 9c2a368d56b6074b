# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials and node groups are renamed with their gratings, until an artist renames them."""

import bpy
import pytest


def names(grating):
    return grating.material.name, grating.group.name


@pytest.fixture
def assigned(grating):
    bpy.ops.grating.lights(lights="LAMPS")
    assert bpy.ops.grating.assign() == {"FINISHED"}
    return grating


def test_a_renamed_grating_renames_its_material_and_group(assigned, scene):
    assert names(assigned) == ("Diffraction waves", "Diffraction waves")
    assigned.name = "Skin"
    assert names(assigned) == ("Diffraction Skin", "Diffraction Skin")
    bpy.ops.grating.assign()
    assert names(assigned) == ("Diffraction Skin", "Diffraction Skin")
    assert scene.natural_gratings.items["Skin"] == assigned and "waves" not in scene.natural_gratings.items
    assert [m.name for m in bpy.data.materials] == ["Diffraction Skin"]


def test_a_name_that_an_artist_gave_stays(assigned):
    assigned.material.name = "Snake"
    assigned.name = "Skin"
    bpy.ops.grating.assign()
    assert names(assigned) == ("Snake", "Diffraction Skin")
    assigned.group.name = "Own"
    assigned.name = "Other"
    assert names(assigned) == ("Snake", "Own")


def test_two_gratings_of_one_name_keep_their_numbers(assigned, scene, baked):
    second = scene.natural_gratings.items.add()
    second.name, second.bake_path = "waves", str(baked)
    scene.natural_gratings.active_index = 1
    for _ in range(2):
        bpy.ops.grating.assign()
    first, second = scene.natural_gratings.items
    assert names(first) == ("Diffraction waves", "Diffraction waves")
    assert names(second) == ("Diffraction waves.001", "Diffraction waves.001")


def test_undo_takes_the_names_back(assigned):
    bpy.ops.ed.undo_push(message="assigned")
    assigned.name = "Skin"
    bpy.ops.ed.undo_push(message="renamed")
    bpy.ops.ed.undo()
    grating = bpy.context.scene.natural_gratings.active()
    assert (grating.name, *names(grating)) == ("waves", "Diffraction waves", "Diffraction waves")
