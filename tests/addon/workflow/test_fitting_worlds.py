# SPDX-License-Identifier: GPL-3.0-or-later
"""When a world's sources are fitted and dropped, and how often its fingerprint is computed for this."""

import numpy as np
import pytest

from precompute.world_sources.sources import Source
from tests.addon.worlds.made import world_with

SUN = Source(np.array((0.0, 0.6, 0.8)), np.array((3.0, 2.0, 1.0)), 1e-4)


@pytest.fixture
def taken(addon, monkeypatch):
    """The fingerprints that were computed."""
    found, fingerprint = [], addon.world_changes.fingerprint
    monkeypatch.setattr(
        addon.world_changes, "fingerprint", lambda *given: found.append(fingerprint(*given)) or found[-1]
    )
    return found


@pytest.fixture
def sky(addon, scene, grating, monkeypatch):
    """The Background of a sky whose sources the assigned grating follows. They are found without a render."""
    import bpy

    monkeypatch.setattr(addon.world_probe, "fit_of", lambda *_: addon.world_probe.Fit(np.ones((2, 4, 3)), [SUN], 0.1))
    scene.world, background = world_with("ShaderNodeTexSky")
    assert bpy.ops.grating.assign() == {"FINISHED"}
    assert addon.sky.source_count(scene) == 1
    bpy.context.view_layer.update()
    yield background
    scene.world = None
    addon.sky.forget_sources(scene)


def test_a_change_takes_one_fingerprint(addon, scene, sky, taken):
    import bpy

    for _ in range(3):
        assert addon.fitting_worlds.world_is_fitted(scene)
    assert len(taken) <= 1
    taken.clear()
    sky.inputs["Strength"].default_value = 2.0
    bpy.context.view_layer.update()
    for _ in range(3):
        assert not addon.fitting_worlds.world_is_fitted(scene)
        assert addon.fitting_worlds.unfitted_world(scene)
    assert addon.sky.source_count(scene) == 0
    assert len(taken) == 1


def test_what_acts_on_a_world_looks_at_it_as_it_is(addon, scene, sky, taken):
    """Even before Blender reports a change: for a fit, and for a render."""
    import bpy

    assert addon.fitting_worlds.world_is_fitted(scene)
    sky.inputs["Strength"].default_value = 2.0
    assert bpy.ops.grating.fit_world() == {"FINISHED"}
    assert addon.sky.fitted_world(scene) == taken[-1] == addon.world_changes.fingerprint(scene.world)
    assert addon.fitting_worlds.world_is_fitted(scene)
    sky.inputs["Strength"].default_value = 3.0
    addon.handlers.show_what_renders(scene)
    assert addon.sky.source_count(scene) == 0 and not addon.fitting_worlds.world_is_fitted(scene)


def test_a_world_that_is_exchanged_is_noticed(addon, scene, sky):
    import bpy

    assert addon.fitting_worlds.world_is_fitted(scene)
    scene.world, _ = world_with("ShaderNodeTexGradient")
    bpy.context.view_layer.update()
    assert not addon.fitting_worlds.world_is_fitted(scene)
    assert addon.sky.source_count(scene) == 0


def test_the_panel_offers_a_fit_that_has_work_and_tells_one_that_failed(addon, scene, grating, sky, monkeypatch):
    """A fit has work if a grating follows the world and the world has changed since its last fit."""
    import bpy

    from tests.addon.layout import Layout, context_of

    def drawn():
        layout, context = Layout(), context_of()
        addon.light_part.draw_light(layout, context, grating, facts=addon.facts.facts_of(context))
        return layout

    assert "grating.fit_world" not in drawn().operators
    sky.inputs["Strength"].default_value = 2.0
    bpy.context.view_layer.update()
    assert "grating.fit_world" in drawn().operators and drawn().noted("ERROR") == ""

    def fail(*_):
        raise addon.child.GratingError("world World", "not rendered", "try again")

    # As with a window, where the fit runs in the background.
    monkeypatch.setattr(addon.world_probe, "Probe", fail)
    running = addon.fitting_worlds._Running(scene.name, addon.fitting_worlds._fingerprint(scene))
    monkeypatch.setattr(addon.fitting_worlds, "_running", running)
    assert addon.fitting_worlds._go_on() is None
    assert "grating.fit_world" in drawn().operators
    assert drawn().noted("ERROR") == "world World: not rendered; try again"
    addon.fitting_worlds._failed.clear()
    bpy.ops.grating.lights(lights="LAMPS")
    assert "grating.fit_world" not in drawn().operators


@pytest.mark.night("test_what_acts_on_a_world_looks_at_it_as_it_is")
@pytest.mark.parametrize("kind", ["ShaderNodeRGB", "ShaderNodeBlackbody"])
def test_an_even_world_needs_no_render(addon, scene, sky, monkeypatch, kind):
    monkeypatch.setattr(addon.world_probe, "fit_of", None)
    scene.world, _ = world_with(kind)
    addon.fitting_worlds.fit_world(scene)
    assert addon.sky.source_count(scene) == 0 and addon.fitting_worlds.world_is_fitted(scene)


def keyed(holder, path):
    for frame, value in ((1, 0.0), (9, 1.0)):
        setattr(holder, path, value)
        holder.keyframe_insert(path, frame=frame)


def turned_by_a_keyed_parent(world):
    import bpy

    turn, parent = bpy.data.objects.new("turn", None), bpy.data.objects.new("parent", None)
    turn.parent = parent
    parent.rotation_euler.z = 0.0
    parent.keyframe_insert("rotation_euler", frame=1)
    parent.rotation_euler.z = 1.0
    parent.keyframe_insert("rotation_euler", frame=9)
    world.node_tree.nodes.new("ShaderNodeTexCoord").object = turn


def in_a_group(world):
    import bpy

    group = bpy.data.node_groups.new("inner", "ShaderNodeTree")
    keyed(group.nodes.new("ShaderNodeValue").outputs[0], "default_value")
    world.node_tree.nodes.new("ShaderNodeGroup").node_tree = group


def a_movie(world):
    import bpy

    image = bpy.data.images.new("clouds", 4, 4)
    image.source = "SEQUENCE"
    world.node_tree.nodes.new("ShaderNodeTexEnvironment").image = image


def background_of(world):
    return next(node for node in world.node_tree.nodes if node.type == "BACKGROUND").inputs["Strength"]


def driven_by(world, expression, path=None, target=None):
    driver = background_of(world).driver_add("default_value").driver
    if target is not None:
        variable = driver.variables.new()
        variable.name, variable.targets[0].id_type, variable.targets[0].id = "x", "SCENE", target
        variable.targets[0].data_path = path
    driver.expression = expression


def shaken(world):
    background_of(world).keyframe_insert("default_value", frame=3)
    (layer,) = world.node_tree.animation_data.action.layers
    layer.strips[0].channelbags[0].fcurves[0].modifiers.new("NOISE")


ANIMATED = {
    "one key that is shaken": lambda world, scene: shaken(world),
    "keys": lambda world, scene: keyed(background_of(world), "default_value"),
    "parent": lambda world, scene: turned_by_a_keyed_parent(world),
    "group": lambda world, scene: in_a_group(world),
    "movie": lambda world, scene: a_movie(world),
    "frame": lambda world, scene: driven_by(world, "frame / 9"),
    "current frame": lambda world, scene: driven_by(world, "x / 9", "frame_current", scene),
}
STILL = {
    "driver, and a keyed lamp": lambda world, scene: (
        keyed(scene.objects["Sun"].data, "energy"),
        driven_by(world, "x * 2", "unit_settings.scale_length", scene),
    ),
    "one key": lambda world, scene: background_of(world).keyframe_insert("default_value", frame=3),
    "driver": lambda world, scene: driven_by(world, "x * 2", "unit_settings.scale_length", scene),
    "nothing": lambda world, scene: None,
}


@pytest.mark.short("nothing", "keys", "driver", "movie", "parent")
@pytest.mark.parametrize("how", [*ANIMATED, *STILL])
def test_an_animated_world_has_no_sources(addon, scene, sky, how):
    """In all frames of a render they would shine where they were at one frame."""
    import bpy

    (ANIMATED | STILL)[how](scene.world, scene)
    assert addon.fitting_worlds.world_is_animated(scene) == (how in ANIMATED)
    bpy.ops.grating.fit_world()
    assert addon.sky.source_count(scene) == (how in STILL)
    told = addon.fitting_worlds.unfitted_world(scene)
    assert [line for line in told if "animated" in line] == told and bool(told) == (how in ANIMATED)


def test_fit_world_fits_anew_even_what_seems_to_fit(addon, scene, sky, monkeypatch):
    import bpy

    fits = []
    monkeypatch.setattr(
        addon.world_probe, "fit_of", lambda *_: fits.append(1) or addon.world_probe.Fit(np.ones((2, 4, 3)), [SUN], 0.1)
    )
    bpy.ops.grating.assign()
    assert not fits
    bpy.ops.grating.fit_world()
    assert fits == [1] and addon.sky.source_count(scene) == 1
