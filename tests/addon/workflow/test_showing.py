# SPDX-License-Identifier: GPL-3.0-or-later
"""Show Me and the presets' drafts: a new scene, and the artist's scene as it was."""

import importlib
from functools import partial

import bpy
import pytest

from devtools import EXTENSION
from precompute.presets.presets import SHAPES, preset_names, read_preset

# The preset whose draft is baked soonest.
PRESET = "gold_foil"


@pytest.fixture(scope="module")
def drafts(extension, tmp_path_factory):
    """A folder with the draft of one preset."""
    make = importlib.import_module(f"{EXTENSION}.precompute.presets.presets")
    bake = importlib.import_module(f"{EXTENSION}.precompute.bake.make").bake_to_folder
    folder = tmp_path_factory.mktemp("drafts")
    request = make.draft_request(make.read_preset(PRESET).request)
    height_maps = [scan.read() for scan in request.scans]
    make.write_draft(request, bake(height_maps, request, folder / PRESET))
    return folder


@pytest.fixture
def shipped(addon, drafts, monkeypatch):
    """The folder of the drafts that the extension ships."""
    module = addon.baking
    monkeypatch.setattr(module, "shipped_draft", partial(module.shipped_draft, folder=drafts))
    return drafts


def facts(scene):
    """What an artist would miss in a scene."""
    render = scene.render
    return (
        [thing.name for thing in scene.objects], scene.world, scene.camera, render.engine, render.resolution_x,
        scene.view_settings.view_transform, scene.view_settings.exposure, len(scene.natural_gratings.items),
    )  # fmt: skip


@pytest.mark.night("test_a_preset_is_put_on_the_selected_meshes_at_once")
def test_show_me_adds_a_scene_and_leaves_the_others(addon, scene, shipped):
    before = facts(scene)
    assert bpy.ops.grating.show_me(preset=PRESET) == {"FINISHED"}
    assert facts(scene) == before
    (show,) = [each for each in bpy.data.scenes if each != scene]
    grating = show.natural_gratings.active()
    assert (grating.name, addon.grating.quality_of(grating)) == ("Gold Holographic Foil", "DRAFT")
    thing = show.view_layers[0].objects.active
    assert show.camera
    assert addon.material.diffraction_nodes(thing.active_material)
    assert {lamp.data.type for lamp in show.objects if lamp.type == "LIGHT"} == {"SUN"}


def test_undo_and_redo_of_show_me_change_the_3d_view_too(addon, scene, shipped, monkeypatch):
    """Blender's undo changes the scene of a window, and leaves its 3D views as they are."""
    monkeypatch.setattr(addon.show_views, "has_window", lambda: True)
    window = bpy.context.window_manager.windows[0]
    (view,) = (area.spaces.active for area in window.screen.areas if area.type == "VIEW_3D")
    mine, shown = ("SOLID", "PERSP"), ("RENDERED", "CAMERA")
    view.shading.type, view.region_3d.view_perspective = mine
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.grating.show_me(preset=PRESET)
    bpy.ops.ed.undo_push(message="Show Me")
    looks = [look_of(view)]
    for step in (bpy.ops.ed.undo, bpy.ops.ed.redo, bpy.ops.grating.back_from_show):
        step()
        looks.append(look_of(view))
    assert looks == [shown, mine, shown, mine]
    assert not addon.show_views.is_show(window.scene)


def look_of(view):
    return view.shading.type, view.region_3d.view_perspective


def test_show_me_reports_a_preset_that_fails_and_leaves_no_scene(addon, scene, shipped, monkeypatch):
    failure = importlib.import_module(f"{EXTENSION}.precompute.base.failure")

    def refuse(*_, **__):
        raise failure.GratingError("CD", "no room", "free some")

    monkeypatch.setattr(addon.presets, "bake_and_wait", refuse)
    with pytest.raises(RuntimeError, match="CD: no room"):
        bpy.ops.grating.show_me(preset="cd")
    assert list(bpy.data.scenes) == [scene]


def test_a_preset_shows_without_a_bake_also_after_its_draft_is_gone(addon, scene, shipped, tmp_path):
    assert bpy.ops.grating.add_preset(preset=PRESET, assign=False) == {"FINISHED"}
    grating = scene.natural_gratings.active()
    kept = grating.baked_file()
    assert not kept.is_relative_to(shipped) and kept.with_suffix(".lobes.exr").is_file()
    assert not addon.bakes.is_asked_otherwise(grating)


def test_a_preset_without_a_draft_waits_for_its_bake(addon, scene, shipped):
    assert bpy.ops.grating.add_preset(preset="cd", assign=False) == {"FINISHED"}
    grating = scene.natural_gratings.active()
    assert not grating.bake_path and addon.grating.quality_of(grating) == "DRAFT"


def test_a_preset_is_put_on_the_selected_meshes_at_once(addon, scene, shipped):
    plane = bpy.context.active_object
    assert bpy.ops.grating.add_preset(preset=PRESET) == {"FINISHED"}
    assert addon.material.diffraction_nodes(plane.active_material)


def test_a_mesh_without_a_uv_map_shows_a_preset_along_its_axis(addon, scene, shipped, capfd):
    plane = bpy.context.active_object
    plane.data.uv_layers.remove(plane.data.uv_layers[0])
    assert bpy.ops.grating.add_preset(preset=PRESET, assign=True) == {"FINISHED"}
    assert addon.material.diffraction_nodes(plane.active_material)
    assert scene.natural_gratings.active().frame_source().kind == "AXIS"
    assert "Plane: no UV map, so the direction follows the object's Z axis" in capfd.readouterr().out


def test_a_preset_that_no_mesh_can_carry_is_not_added(scene, shipped):
    bpy.context.active_object.data.clear_geometry()
    with pytest.raises(RuntimeError, match="no faces"):
        bpy.ops.grating.add_preset(preset=PRESET, assign=True)
    assert len(scene.natural_gratings.items) == 0


@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape_has_a_thing_with_a_uv_map_and_a_stage(addon, scene, shape):
    assert shape in addon.stage.STAGES
    thing = addon.stage.add_thing(scene, shape, "Thing")
    assert thing.data.uv_layers and thing.name in scene.objects


def test_the_draft_quality_is_that_of_the_shipped_drafts(addon):
    made = importlib.import_module(f"{EXTENSION}.precompute.presets.presets")
    draft = addon.grating.QUALITIES[0]
    assert (draft.delta_e, draft.coherence_um) == (made.DELTA_E, pytest.approx(made.COHERENCE_M * 1e6))


def test_every_preset_has_a_picture(addon):
    for name in preset_names():
        assert (addon.preset_pictures.FOLDER / f"{name}.jpg").is_file(), read_preset(name).title


def test_the_lamps_of_a_new_scene_can_be_followed(addon, scene):
    """In Blender 5.2 the view layer of a scene made by a script has no collections before Blender updates it."""
    made = bpy.data.scenes.new("New")
    if bpy.app.version >= (5, 2, 0):
        assert made.view_layers[0].layer_collection is None
    made.collection.objects.link(bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "SUN")))
    addon.lighting.update_all_lamps()
    assert [lamp.name for lamp in addon.follow.followed_lamps(made)] == ["Lamp"]
