# SPDX-License-Identifier: GPL-3.0-or-later
"""Arranging nodes so that the tree is readable."""

from __future__ import annotations

import bpy


def arrange(tree: bpy.types.NodeTree) -> None:
    """Place each node in a column to the right of all nodes that feed it.

    Nodes must have been created in the order of the formula: inputs before their users."""
    feeding: dict[bpy.types.Node, list[bpy.types.Node]] = {}
    for link in tree.links:  # socket.links would search all links for each socket
        feeding.setdefault(link.to_node, []).append(link.from_node)
    depth: dict[bpy.types.Node, int] = {}
    for node in tree.nodes:
        depth[node] = 1 + max((depth.get(before, 0) for before in feeding.get(node, ())), default=-1)
    filled: dict[int, int] = {}
    places: list[int] = []
    for column in depth.values():
        row = filled.get(column, 0)
        filled[column] = row + 1
        places += (column * 220, -row * 220)
    tree.nodes.foreach_set("location", places)  # one by one, Blender would update the tree for each
