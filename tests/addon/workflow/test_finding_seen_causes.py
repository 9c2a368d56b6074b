# SPDX-License-Identifier: GPL-3.0-or-later
"""Why Is It Black?: causes in what the camera or the 3D view sees, and in what lights it."""

import math

import bpy
import pytest

from tests.addon.cameras.test_view_rays import view_like
from tests.addon.colourful import colourful, found, kinds, node_of, press, sun  # noqa: F401  a fixture
from tests.addon.conftest import add_camera, select


def cover(thing):
    """A wall between the plane and the sun, 5 m away, that leaves the camera's view free."""
    bpy.ops.mesh.primitive_plane_add(size=4, location=(4.3, 0, 2.5), rotation=(0, math.radians(60), 0))
    bpy.context.object.name = "Wall"
    bpy.context.view_layer.objects.active = thing


@pytest.mark.skipif(bpy.app.version < (5, 1, 0), reason="no shadows on diffraction")
def test_a_shadow_names_the_object_that_casts_it(addon, colourful):  # noqa: F811
    cover(colourful)
    (cause,) = found(addon)
    assert cause.kind == "SHADED" and "Wall" in cause.sentence
    assert press(cause.button) == {"FINISHED"}
    assert kinds(addon) == []


@pytest.mark.parametrize(
    ("degrees", "kind", "told"),
    [
        (0, "NO_ORDER", "too near to its mirror image; move it further to the side"),
        (20, "NO_ORDER", "too near to its mirror image"),  # 0.34 x 500 = 171 nm, which is ultraviolet
        (120, "BEHIND", "No light of Sun reaches the side of Plane that the camera sees"),
    ],
)
def test_a_lamp_in_the_wrong_place(addon, colourful, degrees, kind, told):  # noqa: F811
    sun().rotation_euler = (0, math.radians(degrees), 0)
    (cause,) = found(addon)
    assert cause.kind == kind and told in cause.sentence
    assert cause.button == addon.subject.light_button()


def test_a_lamp_along_the_grooves(addon, colourful):  # noqa: F811
    sun().rotation_euler = (math.radians(60), 0, 0)
    (cause,) = found(addon)
    assert cause.kind == "NO_ORDER" and "along the grooves" in cause.sentence


def test_a_light_rig_is_offered_where_there_is_one(addon, monkeypatch):
    monkeypatch.setattr(bpy.types, "GRATING_OT_light_rig", object, raising=False)
    button = addon.subject.light_button()
    assert (button.operator, button.properties) == ("grating.light_rig", {"kind": "SUN"})


@pytest.mark.night("tests/addon/workflow/test_noticing_outside.py")
def test_a_bake_for_another_scene(addon, scene, scan, colourful):  # noqa: F811
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    assert bpy.ops.grating.bake() == {"FINISHED"}
    bpy.ops.grating.lights(lights="LAMPS")
    select(colourful)
    bpy.ops.grating.assign()
    assert bpy.ops.grating.needs() == {"FINISHED"}
    assert kinds(addon) == []
    sun().rotation_euler = (0, math.radians(-62), 0)
    first = found(addon)[0]
    assert first.kind == "OUTSIDE" and "of the light that the camera sees on Plane is black" in first.sentence
    assert press(first.button) == {"FINISHED"}
    assert kinds(addon) == []


def test_an_even_world_shows_no_colours_and_a_shining_object_may(addon, scene, colourful):  # noqa: F811
    bpy.ops.grating.lights(lights="REST")
    bpy.data.objects.remove(sun())
    scene.world = bpy.data.worlds.new("Grey")
    first = found(addon)[0]
    assert first.kind == "NO_LAMP" and "an even world shows no colours" in first.sentence
    bpy.ops.mesh.primitive_plane_add(location=(0, 0, 20))
    material = bpy.data.materials.new("Shining")
    addon.compat.enable_nodes(material)
    material.node_tree.nodes["Principled BSDF"].inputs["Emission Strength"].default_value = 5.0
    bpy.context.object.data.materials.append(material)
    assert kinds(addon) == []
    summary = addon.finding_causes.findings(bpy.context).summary
    assert summary == "Found nothing wrong with waves. Not all of its light could be measured."


@pytest.fixture
def window(addon, monkeypatch):
    """Let the search look at the 3D view of the screen, as with a window. The view looks through the camera."""
    for module in (addon.finding_causes, addon.subject):
        monkeypatch.setattr(module, "has_window", lambda: True)
    (view,) = [area.spaces.active for area in bpy.context.screen.areas if area.type == "VIEW_3D"]
    kept = view.shading.type, view.region_3d.view_perspective
    view.shading.type, view.region_3d.view_perspective = "MATERIAL", "CAMERA"
    yield view
    view.shading.type, view.region_3d.view_perspective = kept


@pytest.mark.parametrize("shading", ["SOLID", "WIREFRAME"])
def test_a_3d_view_that_shows_no_materials(addon, colourful, window, shading):  # noqa: F811
    assert kinds(addon) == []
    window.shading.type = shading
    (cause,) = found(addon)
    assert cause.kind == "SHADING" and shading.capitalize() in cause.sentence
    press(cause.button)
    assert window.shading.type == "RENDERED" and kinds(addon) == []


@pytest.mark.parametrize("engine", ["CYCLES", "EEVEE"])
def test_a_3d_view_that_shows_another_pass(addon, scene, colourful, window, engine):  # noqa: F811
    in_cycles = engine == "CYCLES"
    scene.render.engine = engine if in_cycles else addon.compat.eevee_engine()
    window.shading.type = "RENDERED"
    (window.shading.cycles if in_cycles else window.shading).render_pass = "NORMAL"
    (cause,) = found(addon)
    assert cause.sentence == "The 3D view shows the render pass Normal instead of Combined."
    press(cause.button)
    assert kinds(addon) == []


@pytest.mark.parametrize(("lights", "kind"), [("LAMPS", "SCENE_LIGHTS"), ("ALL", "NO_SCENE_LIGHTS")])
def test_a_3d_view_without_the_scenes_lamps(addon, colourful, window, lights, kind):  # noqa: F811
    bpy.ops.grating.lights(lights=lights)
    window.shading.type, window.shading.use_scene_lights_render = "RENDERED", False
    first = found(addon)[0]
    assert first.kind == kind and first.is_warning == (lights == "LAMPS")
    press(first.button)
    assert kind not in kinds(addon)


def test_a_lamp_hidden_by_its_eye(addon, colourful, window):  # noqa: F811
    sun().hide_set(True)
    (cause,) = found(addon)
    assert cause.kind == "DARK_LAMPS" and "Sun is hidden in the 3D view" in cause.sentence
    press(cause.button)
    assert kinds(addon) == []


def test_a_3d_view_looks_before_the_camera_and_without_one(addon, scene, colourful, monkeypatch):  # noqa: F811
    """A view like the camera's sees what the camera sees."""
    by_camera = addon.finding_causes.findings(bpy.context).summary
    view = addon.seen_surfaces.ViewPixels(view_like(scene.camera), (160, 90))
    monkeypatch.setattr(addon.finding_causes, "_view_pixels", lambda context: view)
    by_view = by_camera.replace("the camera", "the 3D view")
    assert addon.finding_causes.findings(bpy.context).summary == by_view
    bpy.data.objects.remove(scene.camera)
    assert addon.finding_causes.findings(bpy.context).summary == by_view


def test_a_view_that_looks_through_the_camera_is_the_camera(addon, colourful, window):  # noqa: F811
    pixels = addon.finding_causes._view_pixels
    assert pixels(bpy.context) is None
    window.region_3d.view_perspective = "PERSP"
    assert type(pixels(bpy.context)) is addon.seen_surfaces.ViewPixels


def test_a_camera_far_away_sees_the_colours_too(addon, scene, colourful):  # noqa: F811
    bpy.data.objects.remove(scene.camera)
    add_camera(scene, (0, 0, 40))
    assert kinds(addon) == []


def test_a_streak_of_colour_is_a_warning(addon, scene, colourful):  # noqa: F811
    """A small mirror on the plane's edge shows the order; the rest of the plane is turned away from the sun."""
    bpy.ops.mesh.primitive_plane_add(size=0.3, location=(0, 0, 1))
    bpy.context.object.data.materials.append(colourful.material_slots[0].material)
    colourful.rotation_euler = (0, math.radians(-45), 0)
    (cause,) = found(addon)
    assert cause.kind == "FEW_COLOURS" and cause.is_warning and "Colours show on only" in cause.sentence
    assert addon.finding_causes.findings(bpy.context).summary == cause.sentence


def test_a_period_that_needs_grazing_light(addon, colourful):  # noqa: F811
    """0.6 x 500 nm: violet needs |u| = 400 / 300 = 1.33, and the sun gives 0.87."""
    node_of(colourful).inputs["Period Scale"].default_value = 0.6
    (cause,) = found(addon)
    assert cause.kind == "NO_ORDER" and "lamp and camera must both graze the surface" in cause.sentence


def test_a_lamp_so_wide_that_colours_mix(addon, colourful):  # noqa: F811
    """A sun with a radius of 57 degrees spreads each order over all the others."""
    sun().data.angle = 2.0
    (cause,) = found(addon)
    assert cause.kind == "WHITE" and "its colours mix to white" in cause.sentence


def test_sources_of_a_world_count_as_lamps(addon, scene, colourful):  # noqa: F811
    """A source where the sun was shows its colours, and one above the camera none."""
    bpy.ops.grating.lights(lights="REST")
    bpy.data.objects.remove(sun())
    scene.world = bpy.data.worlds.new("Sky")
    try:
        for degrees, expected in ((60, []), (0, ["NO_ORDER"])):
            direction = (math.sin(math.radians(degrees)), 0.0, math.cos(math.radians(degrees)))
            scene["ng_world_0_place"], scene["ng_world_0_power"] = [*direction, -1.0], [1.0, 1.0, 1.0, 1.0]
            assert kinds(addon) == expected
    finally:
        del scene["ng_world_0_place"], scene["ng_world_0_power"]
