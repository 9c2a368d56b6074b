# SPDX-License-Identifier: GPL-3.0-or-later
"""Stores how many nodes and links a node group was made with, to detect that an artist deleted some."""

import bpy

from ..blender import stored

# Custom property of a node group, saved in files: the numbers of nodes and links.
_PARTS = "ng_parts"


def note_parts(tree: bpy.types.NodeTree) -> None:
    """Store the numbers of a node group's nodes and links."""
    tree[_PARTS] = f"{len(tree.nodes)} {len(tree.links)}"


def has_parts(tree: bpy.types.NodeTree) -> bool:
    """Whether a node group has at least the stored numbers of nodes and links; true if an older file stores none."""
    nodes, _, links = stored.text(tree, _PARTS).partition(" ")
    if not (nodes.isdecimal() and links.isdecimal() and len(nodes + links) < 20):
        return True
    return len(tree.nodes) >= int(nodes) and len(tree.links) >= int(links)
