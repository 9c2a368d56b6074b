# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes of a surface in a world, over a black base: all that is seen is diffracted."""

import bpy

from .lamp_scenes import add_grating


def assign(stage, path, lights: str):
    """Put the grating of a file on the active object, over black."""
    add_grating(stage, path)
    grating = stage.scene.natural_gratings.active()
    assert bpy.ops.grating.lights(lights=lights) == {"FINISHED"}
    assert bpy.ops.grating.assign() == {"FINISHED"}
    skin = next(node for node in grating.material.node_tree.nodes if node.label == "Skin")
    skin.inputs["Base Color"].default_value = (0, 0, 0, 1)
    return grating


def add_world(stage, colour=(1.0, 1.0, 1.0)):
    """A world of one colour; its Background node's input."""
    world = bpy.data.worlds.new("World")
    stage.addon.compat.enable_nodes(world)
    stage.scene.world = world
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*colour, 1)
    return background.inputs["Color"]
