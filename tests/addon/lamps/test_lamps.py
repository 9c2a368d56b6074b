# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's properties follow every change of its lamps, by drivers that need neither scripts nor the extension.

tests/render/test_lamps.py measures the light in a render.
"""

import math
import re

import bpy
import numpy as np
import pytest
from mathutils import Vector


def add_lamp(scene, kind="SUN", name="Lamp", collection=None, **settings):
    lamp = bpy.data.objects.new(name, bpy.data.lights.new(name, kind))
    for key, value in settings.items():
        setattr(lamp.data, key, value)
    (collection or scene.collection).objects.link(lamp)
    return lamp


def properties(scene) -> list[str]:
    return [key for key, _ in scene.items() if key.startswith("ng_key")]


def read(addon, scene, what, index=0) -> np.ndarray:
    bpy.context.view_layer.update()
    return np.array(scene[addon.lamp_drivers.property_name(index, what)])


@pytest.fixture
def sun(addon, scene):
    addon.follow.follow_lamps(scene)
    return bpy.data.objects["Sun"]


@pytest.mark.parametrize("kind", ["SUN", "POINT", "SPOT", "AREA"])
def test_drivers_are_simple_expressions_whatever_the_lamp(addon, scene, kind):
    # Blender evaluates simple expressions even with scripts forbidden. It truncates expressions over 255 characters.
    deep = scene.collection
    for level in range(12):
        child = bpy.data.collections.new(f"Level {level}")
        deep.children.link(child)
        deep = child
    lamp = add_lamp(scene, kind, "Deep", deep)
    if kind == "AREA":
        lamp.data.shape = "ELLIPSE"
    addon.follow.follow_lamps(scene)
    drivers = [curve.driver for curve in scene.animation_data.drivers]
    assert len(drivers) == 2 * 17
    assert all(driver.is_simple_expression and driver.is_valid for driver in drivers)
    assert max(len(driver.expression) for driver in drivers) < 250


@pytest.mark.parametrize("scale", [(1, 1, 1), (3, 3, 3), (-1, 1, 1), (1, 1, -2)])
def test_direction_follows_parents_turns_scales_and_mirrors(addon, scene, sun, scale):
    parent = bpy.data.objects.new("Parent", None)
    scene.collection.objects.link(parent)
    parent.rotation_euler, parent.scale = (0.2, 0.9, -0.4), scale
    sun.parent, sun.rotation_euler = parent, (0.5, 0, 0.1)
    direction = Vector(read(addon, scene, "place")[:3]).normalized()
    # Single precision: a few units in the last place.
    np.testing.assert_allclose(direction, sun.matrix_world.col[2].xyz.normalized(), atol=2e-6)


def test_direction_follows_an_animation(addon, scene, sun):
    for frame, angle in ((1, 0.0), (11, 1.0)):
        sun.rotation_euler = (angle, 0, 0)
        sun.keyframe_insert("rotation_euler", frame=frame)
    scene.frame_set(11)
    assert read(addon, scene, "place")[1] == pytest.approx(-math.sin(1.0), abs=2e-6)


def test_power_is_strength_exposure_and_colour(addon, scene, sun):
    sun.data.energy, sun.data.exposure, sun.data.color = 3.0, 1.0, (1.0, 0.5, 0.25)
    np.testing.assert_allclose(read(addon, scene, "power")[:3], [6.0, 3.0, 1.5], rtol=1e-6)
    sun.data.color = (1, 1, 1)
    sun.data.use_temperature, sun.data.temperature = True, 3000.0
    np.testing.assert_allclose(read(addon, scene, "power")[:3], 6 * np.array(sun.data.temperature_color), rtol=1e-5)


def test_a_narrow_spot_has_its_own_rim(addon, scene, sun):
    """Numbers next to 1 keep their values, even in a file whose drivers have keys: Blender 5.2 gives a driver's curve
    two keys, and rounds numbers within 1e-4 of one to it."""
    bpy.data.objects.remove(sun)
    add_lamp(scene, "SPOT", spot_size=np.radians(1.0), spot_blend=0.0)
    addon.follow.follow_lamps(scene)
    rims = np.cos(np.radians(0.5)) + np.array([0, 1e-5])
    # Single precision near 1, in an angle's own cosine and in the sum.
    assert [read(addon, scene, what)[3] for what in "zx"] == pytest.approx(rims, abs=2e-7)
    for curve in scene.animation_data.drivers:
        curve.keyframe_points.insert(1.0, 1.0)
    addon.follow.follow_lamps(scene)
    assert not any(len(curve.keyframe_points) for curve in scene.animation_data.drivers)
    assert [read(addon, scene, what)[3] for what in "zx"] == pytest.approx(rims, abs=2e-7)


def test_what_the_render_hides_is_dark(addon, scene, sun):
    held = bpy.data.collections.new("Held")
    scene.collection.children.link(held)
    held.objects.link(sun)
    addon.follow.follow_lamps(scene)
    held.hide_render = True
    assert read(addon, scene, "power")[0] == 1  # still in the scene's own collection
    scene.collection.objects.unlink(sun)
    addon.follow.follow_lamps(scene)
    assert read(addon, scene, "power")[0] == 0
    held.hide_render = False
    assert read(addon, scene, "power")[0] == 1
    sun.hide_render = True
    assert read(addon, scene, "power")[0] == 0


def test_a_scene_without_lamps_has_no_properties(addon, scene, sun):
    bpy.data.objects.remove(sun)
    assert addon.follow.follow_lamps(scene) == []
    assert not properties(scene)
    assert not scene.animation_data.drivers


def test_what_is_as_it_should_be_is_not_written(addon, scene, sun):
    add_lamp(scene, "AREA", "Second")
    addon.follow.follow_lamps(scene)
    before = [curve.as_pointer() for curve in scene.animation_data.drivers]
    bpy.context.view_layer.update()
    assert not updated(lambda: addon.follow.follow_lamps(scene))
    assert [curve.as_pointer() for curve in scene.animation_data.drivers] == before


def updated(do) -> set[str]:
    """The names of the data-blocks that Blender re-evaluates after `do`."""
    found = set()

    def note(_, depsgraph):
        found.update(update.id.name for update in depsgraph.updates)

    bpy.app.handlers.depsgraph_update_post.append(note)
    try:
        do()
        bpy.context.view_layer.update()
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(note)
    return found


def test_lamps_keep_their_places_when_another_becomes_stronger(addon, scene, sun):
    first = add_lamp(scene, "POINT", "A", energy=20.0)
    second = add_lamp(scene, "POINT", "B", energy=10.0)
    assert addon.follow.follow_lamps(scene) == [sun, first, second]
    second.data.energy = 30.0
    assert addon.follow.follow_lamps(scene) == [sun, first, second]
    bpy.data.objects.remove(first)
    assert addon.follow.follow_lamps(scene) == [sun, second]


def test_too_many_lamps_are_named(addon, scene, eight_lamps):
    for k in range(9):
        add_lamp(scene, "POINT", f"P{k}", energy=10.0 + k)
    followed = addon.follow.follow_lamps(scene)
    assert len(followed) == addon.brightest_lamps.FOLLOWED_MAX
    assert followed[0].name == "Sun" and followed[1].name == "P8"
    told = addon.brightest_lamps.unfollowed_features(scene, followed)
    assert told == ["diffraction uses at most 8 lamps; left out: P0, P1; choose lamps in the panel's step Light"]


def test_instanced_lamps_are_named(addon, scene):
    bpy.data.objects.remove(bpy.data.objects["Sun"])
    stock = bpy.data.collections.new("Stock")
    add_lamp(scene, "POINT", "Bulb", stock)
    chain = bpy.data.objects.new("Chain", None)
    chain.instance_type, chain.instance_collection = "COLLECTION", stock
    scene.collection.objects.link(chain)
    bpy.context.view_layer.update()
    told = addon.lighting.warnings_about(scene, bpy.context.evaluated_depsgraph_get())
    assert told == ["instanced lamps do not light diffraction: Bulb; use Object > Apply > Make Instances Real"]


def test_a_scene_without_lamps_is_dark_to_lamps_only(addon, scene, grating):
    bpy.ops.grating.assign()
    bpy.data.objects.remove(bpy.data.objects["Sun"])

    def told():
        return addon.lighting.warnings_about(scene, bpy.context.evaluated_depsgraph_get())

    assert told() == []
    assert bpy.ops.grating.lights(lights="LAMPS") == {"FINISHED"}
    assert told() == ["scene Scene: it has no lamp, so with Lamps Only the diffraction is black; add a sun"]


def test_the_drivers_alone_darken_a_lamp_that_is_gone(addon, scene, sun):
    """As in a Blender without the extension: none of its handlers runs."""
    addon.handlers.unregister()
    try:
        bpy.data.objects.remove(sun)
        assert list(read(addon, scene, "power")) == [0, 0, 0, 0]
    finally:
        addon.handlers.register()


@pytest.fixture
def material(addon, scene, baked):
    """A material that gives the plane diffraction; returns its group."""
    grating = scene.natural_gratings.items.add()
    grating.name, grating.bake_path = "waves", str(baked)
    bpy.context.view_layer.objects.active = plane = next(o for o in scene.objects if o.type == "MESH")
    plane.select_set(True)
    assert bpy.ops.grating.assign() == {"FINISHED"}
    bpy.context.view_layer.update()
    return grating.group


def lamps_in(group) -> int:
    """How many lamps a group's nodes read. A lamp of a loop has no node of its own but its properties'."""
    labels = (re.match(r"(?:Lamp |ng_key_)(\d+)", node.label) for node in group.nodes)
    return len({label[1] for label in labels if label})


def test_without_a_diffraction_group_nothing_is_written(addon, scene):
    add_lamp(scene)
    bpy.context.view_layer.update()
    assert not properties(scene)


def test_lamps_that_come_and_go_are_followed(addon, scene, material):
    second = add_lamp(scene, "POINT", "Second")
    bpy.context.view_layer.update()
    assert addon.follow.followed_lamps(scene)[1:] == [second] and lamps_in(material) == 2
    bpy.data.objects.remove(second)
    bpy.context.view_layer.update()
    assert addon.follow.lamp_count(scene) == 1
    assert lamps_in(material) == 2, "a group that lost a lamp need not be compiled again"
    bpy.ops.grating.assign()
    assert lamps_in(material) == 1


def test_a_mesh_that_moves_does_not_have_its_material_evaluated_again(addon, scene, material):
    plane = next(o for o in scene.objects if o.type == "MESH")
    assert updated(lambda: setattr(plane, "location", (1, 0, 0))) == {plane.name}


def test_a_change_that_drivers_follow_builds_nothing(addon, scene, material, monkeypatch):
    """Blender would recompile a rebuilt group. Drivers only write other numbers into it."""
    sun = bpy.data.objects["Sun"]
    plane = next(o for o in scene.objects if o.type == "MESH")
    monkeypatch.setattr(addon.skin, "fill_group", lambda *_: pytest.fail("the group is built again"))
    assert addon.skin.show_lamps.__globals__["fill_group"] is addon.skin.fill_group
    for change in (
        lambda: setattr(sun, "rotation_euler", (0.1, 0, 0)),
        lambda: setattr(sun.data, "energy", 3.0),
        lambda: setattr(sun.data, "type", "AREA"),
        lambda: setattr(sun, "hide_render", True),
        lambda: bpy.data.objects.remove(sun),
        lambda: add_lamp(scene, "SPOT"),
        lambda: plane.select_set(False),
        lambda: scene.collection.children.link(bpy.data.collections.new("New")),
    ):
        updated(change)
        updated(lambda: None)  # applies the handlers' own changes
        assert not updated(lambda: None), "the handlers cause each other"


def test_nodes_hold_what_the_scene_notes(addon, scene, material):
    """For a lamp, which drivers follow, and for a property that a script writes and announces."""
    addon.lamp_group.read_property(addon.builder.Tree(material), "ng_written")

    def nodes(label: str) -> list[bpy.types.Node]:
        bpy.context.view_layer.update()
        evaluated = material.evaluated_get(bpy.context.evaluated_depsgraph_get())
        return sorted((node for node in evaluated.nodes if node.label == label), key=lambda node: node.type)

    def source() -> list[float]:
        vector, number = nodes("ng_written")
        return [*(socket.default_value for socket in vector.inputs), number.outputs[0].default_value]

    def lamp(what: str) -> list[float]:
        (node,) = nodes("Lamp 0")
        return [*node.inputs[what].default_value, node.inputs[f"{what} 4"].default_value]

    assert source() == [0, 0, 0, 0]
    scene["ng_written"] = [0.0, 0.6, 0.8, -1.5]
    scene.update_tag()
    assert source() == pytest.approx([0, 0.6, 0.8, -1.5])
    bpy.data.objects["Sun"].rotation_euler = (math.pi / 2, 0, 0)
    assert lamp("place")[:3] == pytest.approx([0, -1, 0], abs=1e-6)
    for what in addon.lamp_drivers.PROPERTIES:
        assert lamp(what) == pytest.approx(list(scene[addon.lamp_drivers.property_name(0, what)]))


def test_a_group_that_is_filled_again_keeps_no_driver_of_a_node_that_went(addon, scene, material):
    addon.skin.fill_group(material, addon.skin.responses_in(material), [False, False])
    paths = [curve.data_path for curve in material.animation_data.drivers]
    # Each lamp has four properties of four numbers.
    assert len(paths) == 2 * 16 and all(material.path_resolve(path, False) for path in paths)


def test_undo_pairs_of_handlers_leave_all_as_it_was(addon, scene, material):
    before = described(scene)
    addon.handlers.let_go()
    assert addon.follow.lamp_count(scene) == 0
    addon.handlers.follow_again()
    assert described(scene) == before


def test_no_driver_follows_a_lamp_that_is_gone(addon, scene, material):
    """Also if the last Diffraction group went before the lamp."""
    assert properties(scene)
    bpy.data.node_groups.remove(scene.natural_gratings.active().group)
    bpy.data.objects.remove(bpy.data.objects["Sun"])
    bpy.context.view_layer.update()
    assert properties(scene) == [] and not scene.animation_data.drivers


def test_undo_lets_go_of_lamps_without_a_diffraction_group(addon, scene, sun):
    """Undo may free the lamp that a driver points to."""
    addon.handlers.let_go()
    assert properties(scene) == []


def described(scene) -> set[str]:
    lines = {
        f"{curve.data_path} {curve.array_index} {curve.driver.expression}" for curve in scene.animation_data.drivers
    }
    return lines | set(scene.keys())


def test_groups_that_handlers_fill_make_no_data_block(addon, scene, material):
    """Undo would lose a data-block that a handler made, and the group would point to nothing."""
    before = set(bpy.data.node_groups) | set(bpy.data.texts)
    for k in range(3):
        add_lamp(scene, "POINT", f"P{k}")
    lamp = bpy.data.objects["P0"]
    lamp.light_linking.receiver_collection = bpy.data.collections.new("Receivers")
    bpy.context.view_layer.update()
    assert lamps_in(material) == 4
    assert set(bpy.data.node_groups) | set(bpy.data.texts) == before


def test_drivers_point_to_lamps_and_collections_alone(addon, scene, sun):
    """A lamp's data may be replaced in an undo step that leaves the scene as it is."""
    targets = {
        variable.targets[0].id
        for curve in scene.animation_data.drivers
        for variable in curve.driver.variables
        if variable.type == "SINGLE_PROP"
    }
    assert targets == {sun, scene}
