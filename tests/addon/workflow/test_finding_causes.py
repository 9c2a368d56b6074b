# SPDX-License-Identifier: GPL-3.0-or-later
"""Why Is It Black?: each cause, provoked on a scene that shows colours, is named first, and its button removes it."""

import math
from types import SimpleNamespace

import bpy
import pytest

from tests.addon.colourful import colourful, found, kinds, node_of, press, sun  # noqa: F401  a fixture
from tests.addon.layout import Layout


def into_collection(thing):
    """Move an object into a collection of its own; returns the view layer's entry of the collection."""
    scene, own = bpy.context.scene, bpy.data.collections.new("Own")
    scene.collection.children.link(own)
    for each in list(thing.users_collection):
        each.objects.unlink(thing)
    own.objects.link(thing)
    return bpy.context.view_layer.layer_collection.children["Own"]


def set_input(name, value):
    return lambda thing: setattr(node_of(thing).inputs[name], "default_value", value)


def unlink_output(thing):
    output = thing.material_slots[0].material.node_tree.get_output_node("ALL")
    output.id_data.links.remove(output.inputs["Surface"].links[0])


def mute(thing):
    node_of(thing).mute = True


def leave_slot(thing):
    thing.data.materials.append(bpy.data.materials.new("Other"))
    thing.data.polygons[0].material_index = 1


def remove_picture(thing):
    images = [image for image in bpy.data.images if image.name == "waves"]
    bpy.data.images.remove(images[0])


def remove_uv_map(thing):
    thing.data.uv_layers.remove(thing.data.uv_layers[0])
    thing.data.update_tag()


def flatten_uv_map(thing):
    for corner in thing.data.uv_layers[0].uv:
        corner.vector = (0.5, 0.5)


def follow_the_normal(thing):
    bpy.ops.grating.direction(kind="AXIS", axis="Z")


def exclude_lamp(thing):
    into_collection(sun()).exclude = True


def link_lamp_elsewhere(thing):
    listed = bpy.data.collections.new("Receivers")
    listed.objects.link(bpy.context.scene.camera)
    sun().light_linking.receiver_collection = listed


def exclude_object(thing):
    into_collection(thing).exclude = True


def turn_camera(thing):
    bpy.context.scene.camera.rotation_euler = (0, math.radians(120), 0)


def set_lamp(**values):
    def change(thing):
        for name, value in values.items():
            setattr(sun().data if hasattr(sun().data, name) else sun(), name, value)

    return change


def set_layer(**values):
    return lambda thing: [setattr(bpy.context.view_layer, name, value) for name, value in values.items()]


def hold_out_collection(thing):
    into_collection(thing).holdout = True


def expose(stops):
    return lambda thing: setattr(bpy.context.scene.view_settings, "exposure", stops)


CAUSES = {
    "no output": (unlink_output, "UNLINKED"),
    "muted": (mute, "UNLINKED"),
    "slot without faces": (leave_slot, "NO_FACES"),
    "deleted picture": (remove_picture, "LOST"),
    "hidden object": (lambda thing: setattr(thing, "hide_render", True), "HIDDEN"),
    "object hidden from the camera": (lambda thing: setattr(thing, "visible_camera", False), "HIDDEN"),
    "excluded object": (exclude_object, "HIDDEN"),
    "holdout": (lambda thing: setattr(thing, "is_holdout", True), "HIDDEN"),
    "collection held out": (hold_out_collection, "HIDDEN"),
    "material override": (
        lambda thing: set_layer(material_override=bpy.data.materials.new("Clay"))(thing),
        "VIEW_LAYER",
    ),
    "no surfaces": (set_layer(use_solid=False), "VIEW_LAYER"),
    "strength": (set_input("Strength", 0.0), "STRENGTH"),
    "base blend": (set_input("Base Blend", 1.0), "BASE_BLEND"),
    "height scale": (set_input("Height Scale", 0.0), "HEIGHT_SCALE"),
    "roughness": (set_input("Roughness", 0.8), "ROUGHNESS"),
    "no UV map": (remove_uv_map, "DIRECTION"),
    "flat UV map": (flatten_uv_map, "DIRECTION"),
    "axis along the normal": (follow_the_normal, "DIRECTION"),
    "exposure": (expose(-6.0), "EXPOSURE"),
    "film": (lambda thing: setattr(bpy.context.scene.cycles, "film_exposure", 0.01), "EXPOSURE"),
    "no lamp": (lambda thing: bpy.data.objects.remove(sun()), "NO_LAMP"),
    "hidden lamp": (set_lamp(hide_render=True), "DARK_LAMPS"),
    "lamp hidden from glossy rays": (set_lamp(visible_glossy=False), "DARK_LAMPS"),
    "lamp without power": (set_lamp(energy=0.0), "DARK_LAMPS"),
    "black lamp": (set_lamp(color=(0, 0, 0)), "DARK_LAMPS"),
    "excluded lamp": (exclude_lamp, "DARK_LAMPS"),
    "light linking": (link_lamp_elsewhere, "DARK_LAMPS"),
    "weak lamp": (set_lamp(energy=1e-6), "TOO_WEAK"),
    "turned camera": (turn_camera, "NOT_SEEN"),
}


def test_nothing_is_wrong_with_a_colourful_scene(addon, colourful):  # noqa: F811
    assert kinds(addon) == []
    summary = addon.finding_causes.findings(bpy.context).summary
    assert summary.startswith("Nothing is wrong: lamps show diffraction colours on ")
    assert summary.endswith("% of what the camera sees of Plane.")


@pytest.mark.parametrize("name", CAUSES)
def test_a_cause_is_named_first_and_its_button_removes_it(addon, scene, colourful, name):  # noqa: F811
    scene.render.engine = "CYCLES"
    provoke, kind = CAUSES[name]
    provoke(colourful)
    first = found(addon)[0]
    assert first.kind == kind
    assert press(first.button) == {"FINISHED"}
    assert kind not in kinds(addon)


def test_one_of_two_objects_that_is_held_out_is_named_and_not_measured(addon, scene, colourful):  # noqa: F811
    held = colourful.copy()
    held.name, held.location.x, held.is_holdout = "Held", 1, True
    scene.collection.objects.link(held)
    colourful.location.x = -1
    bpy.context.view_layer.update()
    (cause,) = found(addon)
    assert (cause.kind, cause.is_warning, cause.sentence) == ("HELD_OUT", True, "Held is a holdout.")
    assert addon.finding_causes.findings(bpy.context).summary.endswith("% of what the camera sees of Plane.")


def test_light_groups_without_the_diffraction_are_named(addon, scene, colourful):  # noqa: F811
    scene.render.engine = "CYCLES"
    bpy.ops.scene.view_layer_add_lightgroup(name="Suns")
    sun().lightgroup = "Suns"
    (cause,) = found(addon)
    assert cause.kind == "LIGHT_GROUPS" and cause.is_warning
    assert cause.sentence.startswith("No light group has the diffraction of Plane; give the object a light group")
    assert addon.finding_causes.findings(bpy.context).summary.startswith("Nothing is wrong: ")
    colourful.lightgroup = "Suns"
    assert kinds(addon) == []


def test_before_a_grating_is_assigned(addon, scene, grating):
    assert kinds(addon) == ["NOT_ASSIGNED"]
    assert press(found(addon)[0].button) == {"FINISHED"}
    assert "NOT_ASSIGNED" not in kinds(addon)


def test_without_a_grating(addon, scene):
    (cause,) = found(addon)
    assert (cause.kind, cause.button) == ("NO_GRATING", None)


def test_without_a_bake(addon, scene, scan, grating, tmp_path):
    grating.bake_path = str(tmp_path / "gone.exr")
    assert kinds(addon) == ["BAKE_GONE"]
    bpy.ops.grating.import_height_map(filepath=str(scan), size_um=4, height_nm=100)
    (cause,) = found(addon)
    assert cause.kind == "NOT_BAKED"
    assert press(cause.button) == {"FINISHED"}
    assert kinds(addon) == ["NOT_ASSIGNED"]


def test_a_lost_bake_is_no_cause_while_the_material_works(addon, colourful, grating, tmp_path):  # noqa: F811
    grating.bake_path = str(tmp_path / "gone.exr")
    assert kinds(addon) == []


def test_a_deleted_node_group(addon, colourful):  # noqa: F811
    bpy.data.node_groups.remove(bpy.data.node_groups["Diffraction waves"])
    (cause,) = found(addon)
    assert cause.kind == "LOST"
    assert press(cause.button) == {"FINISHED"}
    assert kinds(addon) == []


@pytest.mark.parametrize(("period", "scale", "told"), [(150, 1.0, "finer than half"), (30000, 2.0, "is 60 um")])
def test_a_period_that_shows_no_colours(addon, colourful, grating, period, scale, told):  # noqa: F811
    grating.summary = f"4 x 4 um\nrelief 100 nm\nperiod {period} nm at 0 deg"
    node_of(colourful).inputs["Period Scale"].default_value = scale
    first = found(addon)[0]
    assert first.kind == "PERIOD" and told in first.sentence
    assert (first.button is None) == (scale == 1.0)


def test_a_period_scale_is_reset(addon, colourful, grating):  # noqa: F811
    grating.summary = "period 500 nm at 0 deg"
    node_of(colourful).inputs["Period Scale"].default_value = 0.2
    first = found(addon)[0]
    assert first.kind == "PERIOD" and "with a Period Scale of 0.2 is 100 nm" in first.sentence
    assert press(first.button) == {"FINISHED"}
    assert kinds(addon) == []


def test_few_samples_are_a_warning(addon, scene, colourful):  # noqa: F811
    scene.render.engine = "CYCLES"
    kept, scene.cycles.samples = scene.cycles.samples, 4
    bpy.ops.grating.lights(lights="ALL")
    (cause,) = found(addon)
    assert cause.kind == "SAMPLES" and cause.is_warning
    press(cause.button)
    assert kinds(addon) == []
    scene.cycles.samples = kept


def test_a_greying_view_transform_is_a_warning_and_comes_last(addon, scene, colourful):  # noqa: F811
    scene.view_settings.view_transform = "AgX"
    (cause,) = found(addon)
    assert cause.kind == "VIEW_TRANSFORM" and cause.is_warning and "AgX" in cause.sentence
    node_of(colourful).inputs["Strength"].default_value = 0.0
    assert kinds(addon) == ["STRENGTH", "VIEW_TRANSFORM"]
    press(cause.button)
    assert scene.view_settings.view_transform == "Khronos PBR Neutral"
    assert kinds(addon) == ["STRENGTH"]


def test_a_hologram_s_strength_is_reset(addon, colourful):  # noqa: F811
    bpy.ops.grating.hologram(pattern="DOT_MATRIX")
    pattern = next(n for n in node_of(colourful).id_data.nodes if n.type == "GROUP" and n != node_of(colourful))
    pattern.inputs["Strength"].default_value = 0.0
    assert kinds(addon)[0] == "STRENGTH"
    press(found(addon)[0].button)
    assert pattern.inputs["Strength"].default_value == 1.0


def test_the_operator_reports_the_first_cause(addon, scene, colourful, capfd):  # noqa: F811
    node_of(colourful).inputs["Strength"].default_value = 0.0
    capfd.readouterr()
    assert bpy.ops.grating.why_black() == {"FINISHED"}
    assert "Strength is 0 in Diffraction waves, which makes the diffraction black." in capfd.readouterr().out


def test_the_popup_draws_four_causes_with_their_buttons(addon, scene, colourful):  # noqa: F811
    scene.view_settings.exposure = -5.0
    for name, value in {"Strength": 0.0, "Base Blend": 1.0, "Height Scale": 0.0, "Roughness": 1.0}.items():
        node_of(colourful).inputs[name].default_value = value
    popup, layout = addon.why_black, Layout()
    popup.WhyBlack.found = addon.finding_causes.findings(bpy.context)
    assert len(popup.WhyBlack.found.causes) == 5
    popup.draw_causes(SimpleNamespace(layout=layout), bpy.context)
    assert layout.operators == ["grating.mend_cause"] * 4
    assert layout.noted("ERROR").startswith(
        "Strength is 0 in Diffraction waves, which makes the diffraction black. Base"
    )
    assert max(map(len, layout.labels)) <= 60


def test_the_popup_of_a_scene_without_a_fault(addon, colourful):  # noqa: F811
    popup, layout = addon.why_black, Layout()
    popup.WhyBlack.found = addon.finding_causes.findings(bpy.context)
    popup.draw_causes(SimpleNamespace(layout=layout), bpy.context)
    assert layout.noted("CHECKMARK").startswith("Nothing is wrong: ") and layout.operators == []


def test_a_lamp_that_only_an_instance_shows(addon, scene, colourful):  # noqa: F811
    held = bpy.data.collections.new("Held")
    held.objects.link(sun())
    scene.collection.objects.unlink(sun())
    empty = bpy.data.objects.new("Instance", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", held
    scene.collection.objects.link(empty)
    (cause,) = found(addon)
    assert cause.kind == "INSTANCED" and "Instanced lamps do not light diffraction: Sun" in cause.sentence
    bpy.data.collections.remove(held)


def test_undo_takes_back_what_a_button_did(addon, scene, colourful):  # noqa: F811
    node_of(colourful).inputs["Strength"].default_value = 0.0
    bpy.ops.ed.undo_push(message="Strength")
    press(found(addon)[0].button)
    bpy.ops.ed.undo_push(message="Remove Cause")
    assert kinds(addon) == []
    bpy.ops.ed.undo()
    assert kinds(addon) == ["STRENGTH"]


def test_every_action_has_a_function_and_every_button_an_operator(addon, scene):
    items = bpy.ops.grating.mend_cause.get_rna_type().properties["action"].enum_items
    assert set(items.keys()) == set(addon.finding_causes.ACTIONS)


def test_an_action_without_a_grating_is_refused_in_one_line(scene):
    with pytest.raises(RuntimeError, match="no object shows its active grating; assign it first"):
        bpy.ops.grating.mend_cause(action="STRENGTH")
