# SPDX-License-Identifier: GPL-3.0-or-later
"""How many nodes and links a node group of ours was made with, so that it is noticed if an artist deletes some."""

import bpy

from ..blender import stored

# A custom property of a node group, also in saved files: the number of nodes, then of links.
_PARTS = "ng_parts"


def note_parts(tree: bpy.types.NodeTree) -> None:
    """Note how many nodes and links a node group has."""
    tree[_PARTS] = f"{len(tree.nodes)} {len(tree.links)}"


def has_parts(tree: bpy.types.NodeTree) -> bool:
    """Whether a node group has at least what was noted. In a file of an earlier version nothing was."""
    nodes, _, links = stored.text(tree, _PARTS).partition(" ")
    if not (nodes.isdecimal() and links.isdecimal() and len(nodes + links) < 20):
        return True
    return len(tree.nodes) >= int(nodes) and len(tree.links) >= int(links)
