# SPDX-License-Identifier: GPL-3.0-or-later
"""Placing nodes so that a person can read the tree."""

from __future__ import annotations

import bpy


def arrange(tree: bpy.types.NodeTree) -> None:
    """Place each node in a column right of all nodes that feed it.

    Nodes must have been made in the order of the formula: inputs before their users."""
    depth: dict[bpy.types.Node, int] = {}
    for node in tree.nodes:
        before = [depth.get(link.from_node, 0) for socket in node.inputs for link in socket.links]
        depth[node] = 1 + max(before, default=-1)
    filled: dict[int, int] = {}
    for node, column in depth.items():
        row = filled.get(column, 0)
        filled[column] = row + 1
        node.location = (column * 220, -row * 220)
