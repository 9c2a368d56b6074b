# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds for the tests."""

import numpy as np


def world_with(kind: str):
    """A new world whose Background is coloured by a node of this kind; returns the world and the Background."""
    import bpy

    world = bpy.data.worlds.new("tested")
    if bpy.app.version < (5, 0, 0):
        world.use_nodes = True
    tree = world.node_tree
    background = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBackground")
    node = tree.nodes.new(kind)
    tree.links.new(next(output for output in node.outputs if output.enabled), background.inputs["Color"])
    return world, background


def painted(values):
    """A picture in memory from (rows, cols, 3), whose pixels are in no file."""
    import bpy

    rows, cols = values.shape[:2]
    image = bpy.data.images.new("painted", cols, rows, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(np.dstack((values, np.ones((rows, cols)))).astype(np.float32).ravel())
    return image
