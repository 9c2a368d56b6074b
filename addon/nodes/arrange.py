# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes placed so that a tree can be read."""

from __future__ import annotations

import bpy


def arrange(tree: bpy.types.NodeTree) -> None:
    """Place nodes in columns by their distance from the inputs, so that the tree can be read."""
    depth: dict[bpy.types.Node, int] = {}
    for node in tree.nodes:  # nodes were made in the order of the formula: inputs come before their users
        before = [depth.get(link.from_node, 0) for socket in node.inputs for link in socket.links]
        depth[node] = 1 + max(before, default=-1)
    filled: dict[int, int] = {}
    for node, column in depth.items():
        row = filled.get(column, 0)
        filled[column] = row + 1
        node.location = (column * 220, -row * 220)
