# SPDX-License-Identifier: GPL-3.0-or-later
"""The sun lamp that takes the place of a sky's sun disc. tests/render/test_sky_sun.py tests its light."""

import math

import bpy
import numpy as np
import pytest

from precompute.world_sources.sources import Source
from tests.addon.layout import Layout, context_of
from tests.addon.worlds.made import world_with

UP, AROUND = math.radians(35), math.radians(57)
BY_SKY = np.array((math.cos(UP) * math.sin(AROUND), math.cos(UP) * math.cos(AROUND), math.sin(UP)))
VARIANCE = math.radians(0.25) ** 2 / 4


@pytest.fixture
def sky(addon, scene, monkeypatch):
    """A Sky Texture whose world has a sun of given light, found without a render; returns the node and the sources."""
    scene.world, background = world_with("ShaderNodeTexSky")
    node = background.inputs["Color"].links[0].from_node
    node.sun_elevation, node.sun_rotation = UP, AROUND
    glow = Source(BY_SKY, np.array((9.0, 9.0, 9.0)), 1e-2)
    sources = [glow, Source(BY_SKY, np.array((3.0, 2.0, 1.0)), VARIANCE)]
    monkeypatch.setattr(addon.world_probe, "fit_of", lambda *_: addon.world_probe.Fit(np.ones((2, 4, 3)), sources, 0.0))
    yield node, sources
    bpy.context.scene.world = None


def to_sun() -> np.ndarray:
    bpy.context.view_layer.update()
    return np.array(bpy.data.objects["Sky Sun"].matrix_world.to_3x3().col[2])


def test_the_lamp_has_the_suns_light(scene, sky):
    node, _ = sky
    assert bpy.ops.grating.add_sky_sun() == {"FINISHED"}
    lamp = bpy.data.objects["Sky Sun"].data
    assert not node.sun_disc
    assert lamp.energy == pytest.approx(3) and list(lamp.color) == pytest.approx((1, 2 / 3, 1 / 3))
    # A disc of the radius r has the variance sin(r)^2 / 4.
    assert lamp.angle == pytest.approx(2 * math.radians(0.25), rel=1e-4)
    np.testing.assert_allclose(to_sun(), BY_SKY, atol=1e-5)


def test_the_next_replaces_it(scene, sky):
    node, sources = sky
    bpy.ops.grating.add_sky_sun()
    node.sun_disc = True
    sources[1] = Source(BY_SKY, np.array((1.0, 1.0, 1.0)), VARIANCE)
    bpy.ops.grating.add_sky_sun()
    assert sorted(thing.name for thing in bpy.data.objects if thing.type == "LIGHT") == ["Sky Sun", "Sun"]
    assert bpy.data.objects["Sky Sun"].data.energy == pytest.approx(1)


def test_undo_brings_the_disc_back(scene, sky):
    name = scene.world.name
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.grating.add_sky_sun()
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert "Sky Sun" not in bpy.data.objects
    assert all(node.sun_disc for node in bpy.data.worlds[name].node_tree.nodes if node.type == "TEX_SKY")


def test_a_world_without_a_disc_is_refused(scene, sky):
    node, sources = sky
    sources.pop()
    with pytest.raises(RuntimeError, match="its sun is not seen"):
        bpy.ops.grating.add_sky_sun()
    assert node.sun_disc and "Sky Sun" not in bpy.data.objects
    node.sun_disc = False
    assert not bpy.ops.grating.add_sky_sun.poll()
    scene.world = None
    assert not bpy.ops.grating.add_sky_sun.poll()


@pytest.mark.parametrize("engine", ["EEVEE", "CYCLES"])
def test_the_panel_offers_it_in_eevee(addon, scene, grating, sky, engine):
    """Before Blender 5.3, whose EEVEE draws the disc."""
    node, _ = sky
    scene.render.engine = addon.compat.eevee_engine() if engine == "EEVEE" else engine
    offered = engine == "EEVEE" and not addon.compat.EEVEE_DRAWS_SUN_DISC

    def drawn():
        layout, context = Layout(), context_of()
        addon.light_part.draw_light(layout, context, grating, facts=addon.facts.facts_of(context))
        return layout.operators

    assert ("grating.add_sky_sun" in drawn()) == offered
    node.sun_disc = False
    assert "grating.add_sky_sun" not in drawn()
