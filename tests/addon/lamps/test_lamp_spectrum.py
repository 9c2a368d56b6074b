# SPDX-License-Identifier: GPL-3.0-or-later
"""A lamp's own spectrum: its field, its row in the scene's properties, the panel, and the bake for it."""

import json
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

from precompute.colour.channels import row_of
from precompute.colour.spaces import lamp_rgb
from tests.addon.layout import Layout, context_of


@pytest.fixture
def lamp(scene):
    made = bpy.data.objects.new("Key", bpy.data.lights.new("Key", "SUN"))
    scene.collection.objects.link(made)
    return made


def followed(addon, scene):
    addon.follow.follow_lamps(scene)
    bpy.context.view_layer.update()
    return scene.get("ng_key_0_spectrum")


def test_a_white_lamp_has_no_property(addon, scene, lamp):
    lamp.data.color = (1.0, 0.5, 0.1)
    assert followed(addon, scene) is None
    assert addon.lamp_spectrum.seen_spectrum(lamp.data) == ""


@pytest.mark.parametrize(
    ("typed", "kept"),
    [("tube", "FL11"), ("led-b1", "LED-B1"), ("589NM", "589nm"), ("flash", "D5500"), ("sun", "D55"), ("d65", "D65")],
)
def test_a_name_gives_the_lamp_its_colour_and_its_row(addon, scene, lamp, typed, kept):
    lamp.data.diffraction_spectrum = typed
    assert lamp.data.diffraction_spectrum == kept
    np.testing.assert_allclose(lamp.data.color, lamp_rgb("Rec.709", kept), rtol=1e-6)
    assert list(followed(addon, scene)) == [row_of(kept)]
    lamp.data.diffraction_spectrum = ""
    assert tuple(lamp.data.color) == (1, 1, 1)
    assert followed(addon, scene) is None


def test_a_black_body_becomes_the_temperature(addon, scene, lamp):
    lamp.data.diffraction_spectrum = "tungsten"
    assert (lamp.data.diffraction_spectrum, lamp.data.use_temperature, lamp.data.temperature) == ("", True, 2700)
    assert round(followed(addon, scene)[0]) == row_of("2700K")
    lamp.data.temperature = 5000
    bpy.context.view_layer.update()
    assert round(scene["ng_key_0_spectrum"][0]) == row_of("5000K")
    assert addon.lamp_spectrum.seen_spectrum(lamp.data) == "5000K"


def test_the_panel_s_field_shows_a_temperature_as_typed(scene, lamp):
    lamp.data.diffraction_spectrum_shown = "2700K"
    assert (lamp.data.diffraction_spectrum_shown, lamp.data.temperature) == ("2700K", 2700)
    lamp.data.temperature = 5000
    assert lamp.data.diffraction_spectrum_shown == "5000K"
    lamp.data.diffraction_spectrum_shown = ""
    assert (lamp.data.diffraction_spectrum_shown, lamp.data.use_temperature) == ("", False)
    for typed, kept in (("tube", "FL11"), ("nosuch", "nosuch")):
        lamp.data.diffraction_spectrum_shown = typed
        assert lamp.data.diffraction_spectrum_shown == lamp.data.diffraction_spectrum == kept


def test_an_emptied_field_leaves_an_artist_s_own_colour(scene, lamp):
    lamp.data.color, lamp.data.use_temperature, lamp.data.temperature = (1.0, 0.5, 0.25), True, 3000
    lamp.data.diffraction_spectrum = ""
    assert (tuple(lamp.data.color), lamp.data.use_temperature) == ((1.0, 0.5, 0.25), True)
    lamp.data.diffraction_spectrum = "tube"
    assert not lamp.data.use_temperature
    lamp.data.diffraction_spectrum = ""
    assert tuple(lamp.data.color) == (1, 1, 1)


@pytest.mark.parametrize(
    "text",
    [
        "nosuch",
        "FL13",
        "smooth",
        "FL11+FL2",
        "0K",
        "900K",
        "399nm",
        "nowhere/lamp.csv",
        "-5nm",
        "LED",
        "D100",
        "+",
        "-",
    ],
)
def test_a_wrong_text_is_told_and_changes_nothing(addon, scene, lamp, text):
    lamp.data.color = (1.0, 0.5, 0.1)
    lamp.data.diffraction_spectrum = text
    assert lamp.data.diffraction_spectrum == text
    assert tuple(lamp.data.color) == pytest.approx((1.0, 0.5, 0.1))
    assert followed(addon, scene) is None
    layout = Layout(folded=False)
    context = SimpleNamespace(light=lamp.data, **vars(context_of()))
    addon.light_part.LampSpectrumPanel.draw(SimpleNamespace(layout=layout), context)
    assert text in layout.noted("ERROR").replace(" ", "") or text in layout.noted("ERROR")


def test_stop_following_leaves_no_property(addon, scene, lamp):
    lamp.data.diffraction_spectrum = "tube"
    followed(addon, scene)
    addon.follow.stop_following(scene)
    assert not [name for name in scene.keys() if "spectrum" in name]  # noqa: SIM118  # no iterable


def test_sources_of_a_world_take_the_nearest_temperature(addon, scene):
    warm, white = (
        SimpleNamespace(direction=(0, 0, 1), variance=1e-4, irradiance=rgb)
        for rgb in (lamp_rgb("Rec.709", "3000K"), (1.0, 1.0, 1.0))
    )
    addon.sky.hold_sources(scene, [white, white], fingerprint="a", missed=0.0)
    assert not addon.sky.coloured_sources(scene)
    addon.sky.hold_sources(scene, [white, warm], fingerprint="a", missed=0.0)
    assert addon.sky.coloured_sources(scene)
    assert [list(scene[f"ng_world_{k}_spectrum"]) for k in range(2)] == [[0], [row_of("3000K")]]
    frames = {1: [warm], 3: [white, warm]}
    addon.sky.hold_frames(scene, frames, fingerprints={1: "a", 3: "b"}, missed=0.0)
    for frame, rows in ((1, [row_of("3000K"), 0]), (2, [0, 0]), (3, [0, row_of("3000K")])):
        scene.frame_set(frame)
        assert [scene[f"ng_world_{k}_spectrum"][0] for k in range(2)] == rows
    addon.sky.forget_sources(scene)
    assert not [name for name in scene.keys() if "ng_world" in name]  # noqa: SIM118  # no iterable


def test_far_lamps_are_told_with_the_bake_s_figures(addon, scene, lamp):
    group = bpy.data.node_groups.new("Response", "ShaderNodeTree")
    addon.lamp_errors.note_lamp_errors(group, "D65", {"2000K": [7, 30], "4000K": [2, 6], "FL11": [5, 17]})
    assert addon.lamp_errors._stated(group)["FL11"] == (5.0, 17.0)
    for forged in ("[]", "{", json.dumps({"FL11": "x"}), json.dumps({"FL11": [1, None]})):
        group["ng_lamp_errors"] = forged
        assert addon.lamp_errors._stated(group) == {}


def test_the_bake_of_a_scene_serves_its_lamps(addon, scene, lamp):
    assert addon.baking.light_of_scene(scene) == "D65+smooth"
    lamp.data.use_temperature, lamp.data.temperature = True, 3000
    other = bpy.data.objects.new("Rim", bpy.data.lights.new("Rim", "POINT"))
    scene.collection.objects.link(other)
    other.data.diffraction_spectrum = "tube"
    assert addon.baking.light_of_scene(scene) == "D65+smooth+FL11"
    other.data.diffraction_spectrum = "warm-led"
    assert addon.baking.light_of_scene(scene) == "D65+led"


def test_the_button_bakes_for_the_lamps_of_the_scene(addon, scene, lamp, scan):
    bpy.ops.mesh.primitive_plane_add()
    assert bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100) == {"FINISHED"}
    grating = scene.natural_gratings.active()
    grating.coherence_um = 2
    assert bpy.ops.grating.bake() == {"FINISHED"}
    assert bpy.ops.grating.assign() == {"FINISHED"}
    assert addon.lamp_errors.far_lamps(grating.group, scene) == []
    lamp.data.diffraction_spectrum = "tube"
    followed(addon, scene)
    (line,) = addon.lamp_errors.far_lamps(grating.group, scene)
    assert line == "Key: the colours under this light are visibly off; bake for it"
    assert any(line in told for told in addon.lighting.warnings_about(scene, bpy.context.view_layer.depsgraph))
    other = next(each for each in addon.follow.followed_lamps(scene) if each.data is not lamp.data)
    for spectrum, told in (("tube", " and 1 more:"), ("sodum", ":")):  # a faulty text is told beside its field
        other.data.diffraction_spectrum = spectrum
        followed(addon, scene)
        assert told in addon.lamp_errors.far_lamps(grating.group, scene)[0][:30]
    other.data.diffraction_spectrum = ""
    followed(addon, scene)
    layout = Layout(folded=False)
    addon.facts.stop()
    addon.light_part.draw_light(layout, context_of(), grating, facts=addon.facts.facts_of(context_of()))
    assert "diffraction_spectrum_shown" in layout.props
    assert "grating.bake" in layout.operators
    assert bpy.ops.grating.bake(for_lamps=True) == {"FINISHED"}
    assert grating.illuminant == "D65+FL11"
    assert addon.lamp_errors.far_lamps(grating.group, scene) == []
    linked = [node.inputs["Spectrum"].is_linked for node in grating.group.nodes if node.label == "Response"]
    assert linked.count(True) == 1  # the scene's other lamp is white
    addon.facts.stop()
