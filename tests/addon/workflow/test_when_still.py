# SPDX-License-Identifier: GPL-3.0-or-later
"""With a window open, handlers look only at what a change concerns. Each change to a world or a lamp is seen at once,
or after a moment without changes: the scene then holds the same as after looking at everything."""

import time

import bpy
import pytest

from tests.addon.worlds.test_fingerprint import CHANGES as WORLD_CHANGES
from tests.addon.worlds.test_fingerprint import node, world  # noqa: F401  a fixture

# Changes that Blender does not report to handlers: a picture that is painted, packed or scaled, and a curve's point
# that a script moves (the curve's widget reports it).
UNTOLD = {"painted", "size", "curve"}


@pytest.fixture
def window(addon, scene, monkeypatch):
    """Let the handlers and the panel behave as with a window open; no timer runs by itself."""
    for module in (addon.handlers, addon.facts):
        monkeypatch.setattr(module, "has_window", lambda: True)
    addon.facts.stop()
    # No world is rendered: the tests ask what the handlers find out, not for sources.
    for module in (addon.fitting_worlds, addon.assigning, addon.handlers):
        monkeypatch.setattr(module, "want_fit", addon.fitting_worlds.drop_stale_sources)
    yield
    scene.world = None
    addon.sky.forget_sources(scene)
    for timer in (addon.handlers._follow_when_still, addon.facts._find_again):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)


def be_still(addon):
    """Let the timers run after a moment without changes."""
    time.sleep(addon.session.STILL)
    for timer in (addon.handlers._follow_when_still, addon.facts._find_again):
        if bpy.app.timers.is_registered(timer):
            assert timer() is None


@pytest.mark.short("strength", "texture mapping", "[link", "mute", "in a group", "ramp", "sun", "object", "painted")
@pytest.mark.parametrize("how", WORLD_CHANGES)
def test_a_world_that_changed_is_not_known_as_it_was(addon, scene, grating, window, world, how):  # noqa: F811
    scene.world = world
    assert bpy.ops.grating.assign() == {"FINISHED"}
    node(world, "ShaderNodeTexEnvironment").image.pixels[0] = 1.0
    addon.handlers.follow_file()
    assert addon.fitting_worlds.world_is_known(scene)
    before = addon.fitting_worlds._known_world(scene).fingerprint
    WORLD_CHANGES[how](world)
    bpy.context.view_layer.update()
    if how in UNTOLD:
        scene.update_tag()  # the next change of anything
        bpy.context.view_layer.update()
        be_still(addon)
    after = addon.fitting_worlds._known_world(scene).fingerprint
    assert before != after == addon.fitting_worlds._fingerprint(scene)


def test_a_world_is_not_looked_at_while_a_lamp_is_dragged(addon, scene, grating, window, world, monkeypatch):  # noqa: F811
    scene.world = world
    assert bpy.ops.grating.assign() == {"FINISHED"}
    be_still(addon)
    found, fingerprint = [], addon.world_changes.fingerprint
    monkeypatch.setattr(addon.world_changes, "fingerprint", lambda *given: found.append(1) or fingerprint(*given))
    for step in range(3):
        scene.objects["Sun"].location.x = step + 1.0
        bpy.context.view_layer.update()
        scene.objects["Sun"].data.energy = step + 2.0
        bpy.context.view_layer.update()
    assert not found
    be_still(addon)
    assert len(found) == 1


def in_another_collection(scene, sun):
    held = bpy.data.collections.new("Other")
    scene.collection.children.link(held)
    held.objects.link(sun)
    held.hide_render = True
    scene.collection.objects.unlink(sun)


def add_diffraction_lamp(scene, sun):
    scene.collection.objects.link(bpy.data.objects.new("New", bpy.data.lights.new("New", "POINT")))


def exclude(scene, sun):
    in_another_collection(scene, sun)
    bpy.context.view_layer.layer_collection.children["Other"].exclude = True


def parent_to_lamp(scene, sun):
    sun.parent = bpy.data.objects["Plane"]


LAMP_CHANGES = {
    "moved": lambda scene, sun: setattr(sun, "location", (1, 2, 3)),
    "turned": lambda scene, sun: setattr(sun, "rotation_euler", (1, 2, 3)),
    "stronger": lambda scene, sun: setattr(sun.data, "energy", 7.0),
    "another kind": lambda scene, sun: setattr(sun.data, "type", "AREA"),
    "another shape": lambda scene, sun: (setattr(sun.data, "type", "AREA"), setattr(sun.data, "shape", "DISK")),
    "other data": lambda scene, sun: setattr(sun, "data", bpy.data.lights.new("Spot", "SPOT")),
    "hidden by the eye": lambda scene, sun: sun.hide_set(True),
    "hidden in viewports": lambda scene, sun: setattr(sun, "hide_viewport", True),
    "hidden in renders": lambda scene, sun: setattr(sun, "hide_render", True),
    "not in reflections": lambda scene, sun: setattr(sun, "visible_glossy", False),
    "in a hidden collection": in_another_collection,
    "excluded": exclude,
    "linked to objects": lambda scene, sun: setattr(
        sun.light_linking, "receiver_collection", bpy.data.collections.new("Receivers")
    ),
    "another lamp": add_diffraction_lamp,
    "removed": lambda scene, sun: bpy.data.objects.remove(sun),
    "its data removed": lambda scene, sun: bpy.data.lights.remove(sun.data),
    "parented": parent_to_lamp,
}


def noted(scene):
    """Everything the scene stores about its lamps: its properties, their drivers, and its view layers' properties."""
    curves = scene.animation_data.drivers if scene.animation_data else ()
    drivers = {(curve.data_path, curve.array_index): curve.driver.expression for curve in curves}
    own = {name: [*value] for name, value in scene.items() if name.startswith("ng_key")}
    layers = [
        {name: [*value] for name, value in layer.items() if name.startswith("ng_")} for layer in scene.view_layers
    ]
    marks = {thing.name: [name for name, _ in thing.items() if name.startswith("ng_")] for thing in scene.objects}
    lamps = [len(group["ng_lamps"]) for group in bpy.data.node_groups if "ng_lamps" in group]
    return drivers, own, layers, marks, lamps


@pytest.mark.short(
    "moved",
    "another kind",
    "other data",
    "hidden by the eye",
    "not in reflections",
    "excluded",
    "linked to objects",
    "its data removed",
    "parented",
)
@pytest.mark.parametrize("how", LAMP_CHANGES)
def test_what_changes_of_a_lamp_is_followed_at_once(addon, scene, grating, window, how):
    assert bpy.ops.grating.assign() == {"FINISHED"}
    be_still(addon)
    LAMP_CHANGES[how](scene, scene.objects["Sun"])
    for _ in range(2):  # drivers follow a step later
        bpy.context.view_layer.update()
    at_once = noted(scene)
    be_still(addon)
    addon.handlers.follow_file()
    bpy.context.view_layer.update()
    assert at_once == noted(scene)


def test_looking_at_everything_changes_nothing_and_ends(addon, scene, grating, window):
    """Otherwise it would call itself forever."""
    assert bpy.ops.grating.assign() == {"FINISHED"}
    scene.objects["Sun"].location.x = 1.0
    for _ in range(2):
        bpy.context.view_layer.update()
        assert bpy.app.timers.is_registered(addon.handlers._follow_when_still)
        time.sleep(addon.session.STILL)
        assert addon.handlers._follow_when_still() is None
        bpy.app.timers.unregister(addon.handlers._follow_when_still)  # as Blender does then
        bpy.context.view_layer.update()
        assert not bpy.app.timers.is_registered(addon.handlers._follow_when_still)
        scene.objects["Sun"].data.energy += 1.0


def test_of_too_many_lamps_the_brightest_are_chosen_once_it_is_still(addon, scene, grating, window, monkeypatch):
    """A lamp beside the plane replaces the weakest of eight others, if at most eight count."""
    monkeypatch.setattr(addon.brightest_lamps, "FOLLOWED_MAX", 8)
    assert bpy.ops.grating.assign() == {"FINISHED"}
    for number in range(8):
        lamp = bpy.data.objects.new(f"Far {number}", bpy.data.lights.new("Far", "POINT"))
        lamp.data.energy, lamp.location = 100.0 + number, (0, 0, 10)
        scene.collection.objects.link(lamp)
    near = bpy.data.objects.new("Near", bpy.data.lights.new("Near", "POINT"))
    near.data.energy, near.location = 1.0, (0, 0, 100)
    scene.collection.objects.link(near)
    bpy.context.view_layer.update()
    be_still(addon)
    assert near not in addon.follow.followed_lamps(scene)
    near.location.z = 0.2
    bpy.context.view_layer.update()
    assert near not in addon.follow.followed_lamps(scene)
    be_still(addon)
    assert near in addon.follow.followed_lamps(scene)


def test_the_panel_shows_the_former_facts_until_it_is_still(addon, scene, grating, window):
    assert bpy.ops.grating.assign() == {"FINISHED"}
    facts = addon.facts.facts_of(bpy.context)
    assert [lamp.name for lamp in facts.scene.lamps] == ["Sun"]
    add_diffraction_lamp(scene, None)
    bpy.context.view_layer.update()
    assert addon.facts.facts_of(bpy.context) is facts
    be_still(addon)
    assert [lamp.name for lamp in addon.facts.facts_of(bpy.context).scene.lamps] == ["Sun", "New"]


def test_another_grating_has_its_own_facts_at_once(addon, scene, grating, window):
    assert bpy.ops.grating.assign() == {"FINISHED"}
    assert addon.facts.facts_of(bpy.context).grating.objects == "On: Plane"
    scene.natural_gratings.items.add().name = "other"
    scene.natural_gratings.active_index = 1
    assert addon.facts.facts_of(bpy.context).grating.objects == ""


def test_what_blender_does_not_tell_of_is_found_after_a_second(addon, scene, grating, window, monkeypatch):
    assert bpy.ops.grating.assign() == {"FINISHED"}
    addon.facts.facts_of(bpy.context)
    addon.facts.facts_of(bpy.context)
    assert not bpy.app.timers.is_registered(addon.facts._find_again)
    now = time.monotonic()
    monkeypatch.setattr(addon.facts.time, "monotonic", lambda: now + addon.facts._OLD_SECONDS + 10)
    addon.facts.facts_of(bpy.context)
    assert bpy.app.timers.is_registered(addon.facts._find_again)
