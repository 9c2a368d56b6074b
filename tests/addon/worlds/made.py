# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds for the tests."""


def world_with(kind: str):
    """A new world whose Background is coloured by a node of this kind; the world and the Background."""
    import bpy

    world = bpy.data.worlds.new("tested")
    if bpy.app.version < (5, 0, 0):
        world.use_nodes = True
    tree = world.node_tree
    background = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBackground")
    node = tree.nodes.new(kind)
    tree.links.new(next(output for output in node.outputs if output.enabled), background.inputs["Color"])
    return world, background
