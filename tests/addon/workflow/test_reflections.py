# SPDX-License-Identifier: GPL-3.0-or-later
"""What a metal has to reflect: the cards of a light rig, and the warning without them."""

import bpy
import numpy as np

from tests.addon.conftest import reports


def rig():
    """The lamps in the rig's collection, by name."""
    return {thing.name: thing for thing in bpy.data.collections["Light Rig"].objects}


def test_a_metal_in_a_dim_world_gets_cards_to_reflect(watched, addon, mirror, capfd):
    """Only there: a bright world is reflected, and Lamps Only reflects nothing. Cards leave matt surfaces as they are,
    and a second press does not take the first one's for something to reflect."""
    scene = bpy.context.scene
    grating, former = scene.natural_gratings.active(), scene.world
    scene.world = bpy.data.worlds.new("Dim")
    addon.compat.enable_nodes(scene.world)
    light, dim = scene.world.node_tree.nodes["Background"].inputs["Color"], (0.05, 0.05, 0.05, 1)
    warning = "it has little to reflect in this dim world, so it looks dark; press Light Rig"
    bpy.ops.grating.lights(lights="REST")
    grating.bake_path, grating.matter = str(mirror), "MIRROR"
    for colour, count, warned in (((1, 1, 1, 1), 0, False), (dim, 1, True), (dim, 1, False)):
        light.default_value = colour
        assert (warning in reports(bpy.ops.grating.assign, capfd)) == warned
        bpy.ops.grating.light_rig()
        cards = [lamp for name, lamp in rig().items() if "Card" in name]
        assert len(cards) == count
        if not count:  # as if no rig had been pressed
            bpy.data.batch_remove(list(rig().values()))
    (card,) = cards
    assert not card.visible_diffuse and card.data.diffuse_factor == 0 and card.data.energy > 0
    bpy.context.view_layer.update()
    sent = [len(addon.irradiance.lamps_sent(scene, watched, np.zeros((1, 3)), cards=cards)) for cards in (True, False)]
    assert sent == [3, 2]  # the checks of colours ignore it
    assert np.allclose(card.matrix_world.col[2].xyz, (0, 0, 1), atol=0.2)  # the plane mirrors the camera's own side
    bpy.ops.grating.lights(lights="LAMPS")
    bpy.ops.grating.light_rig()
    assert list(rig()) == ["Rig Sun"]
    scene.world = former
    bpy.data.batch_remove(list(bpy.data.collections))
