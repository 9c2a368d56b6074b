# SPDX-License-Identifier: GPL-3.0-or-later
"""When a world's sources are fitted and given up, and how often its fingerprint is taken for that."""

import numpy as np
import pytest

from precompute.lights.sources import Source
from tests.addon.worlds.made import world_with

SUN = Source(np.array((0.0, 0.6, 0.8)), np.array((3.0, 2.0, 1.0)), 1e-4)


@pytest.fixture
def taken(addon, monkeypatch):
    """The fingerprints that were taken."""
    found, fingerprint = [], addon.fingerprint.fingerprint
    monkeypatch.setattr(addon.fingerprint, "fingerprint", lambda world: found.append(fingerprint(world)) or found[-1])
    return found


@pytest.fixture
def sky(addon, scene, grating, monkeypatch):
    """The Background of a sky whose sources the assigned grating follows. They are found without a render."""
    import bpy

    monkeypatch.setattr(addon.probe, "fit_of", lambda *_: addon.probe.Fit(None, [SUN], 0.1))
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
        assert addon.fit_world.world_is_fitted(scene)
    assert len(taken) <= 1
    taken.clear()
    sky.inputs["Strength"].default_value = 2.0
    bpy.context.view_layer.update()
    for _ in range(3):
        assert not addon.fit_world.world_is_fitted(scene)
        assert addon.fit_world.unfitted_world(scene)
    assert addon.sky.source_count(scene) == 0
    assert len(taken) == 1


def test_what_acts_on_a_world_looks_at_it_as_it_is(addon, scene, sky, taken):
    """Also before Blender has told of a change: a fit, and a render."""
    import bpy

    assert addon.fit_world.world_is_fitted(scene)
    sky.inputs["Strength"].default_value = 2.0
    assert bpy.ops.grating.fit_world() == {"FINISHED"}
    assert addon.sky.fitted_world(scene) == taken[-1] == addon.fingerprint.fingerprint(scene.world)
    assert addon.fit_world.world_is_fitted(scene)
    sky.inputs["Strength"].default_value = 3.0
    addon.keep_lamps.show_what_renders(scene)
    assert addon.sky.source_count(scene) == 0 and not addon.fit_world.world_is_fitted(scene)


def test_a_world_that_is_exchanged_is_noticed(addon, scene, sky):
    import bpy

    assert addon.fit_world.world_is_fitted(scene)
    scene.world, _ = world_with("ShaderNodeTexGradient")
    bpy.context.view_layer.update()
    assert not addon.fit_world.world_is_fitted(scene)
    assert addon.sky.source_count(scene) == 0


@pytest.mark.parametrize("kind", ["ShaderNodeRGB", "ShaderNodeBlackbody"])
def test_an_even_world_needs_no_render(addon, scene, sky, monkeypatch, kind):
    monkeypatch.setattr(addon.probe, "fit_of", None)
    scene.world, _ = world_with(kind)
    addon.fit_world.fit_world(scene)
    assert addon.sky.source_count(scene) == 0 and addon.fit_world.world_is_fitted(scene)
