# SPDX-License-Identifier: GPL-3.0-or-later
"""A self-contained copy of a world, whose file includes no objects or scenes."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import bpy

from ..blender import compat

# Nodes that give the same result in all directions. Other nodes may vary.
_EVEN = {
    "OUTPUT_WORLD", "BACKGROUND", "RGB", "VALUE", "BLACKBODY", "WAVELENGTH", "MATH", "MIX", "MIX_SHADER", "ADD_SHADER",
    "REROUTE", "FRAME", "LIGHT_PATH",
}  # fmt: skip


@dataclass
class StandAlone:
    """A copy of a world, and what is missing in it.

    objects     one entry per node property that refers to an object: "tree" (name of the group, or "" for the world
                itself), "node", "property", and "matrix" (the object's world matrix, row by row)
    copies      the copy and the copies of its node groups"""

    world: bpy.types.World
    objects: list[dict[str, Any]] = field(default_factory=list)
    copies: list[bpy.types.ID] = field(default_factory=list)

    def painted(self) -> list[bpy.types.Image]:
        """The nodes' pictures with unsaved painted pixels."""
        trees = [self.world.node_tree, *(copy for copy in self.copies if isinstance(copy, bpy.types.NodeTree))]
        images = {getattr(node, "image", None) for tree in trees if tree for node in tree.nodes}
        return sorted(
            (image for image in images if image is not None and image.is_dirty), key=lambda image: image.name_full
        )


def is_even(world: bpy.types.World) -> bool:
    """Whether the world's nodes give the same colour in all directions."""
    tree = compat.world_nodes(world)
    return tree is None or all(node.type in _EVEN for node in tree.nodes)


@contextlib.contextmanager
def stand_alone(world: bpy.types.World) -> Iterator[StandAlone]:
    """Copy a world at the current frame, without animation and references to objects. The copy is removed on exit."""
    copy = world.copy()
    alone = StandAlone(copy, copies=[copy])
    try:
        copy.animation_data_clear()
        for name in [name for name, value in copy.items() if isinstance(value, bpy.types.ID)]:
            del copy[name]
        if copy.node_tree:
            _cut_loose(copy.node_tree, "", alone, {})
        yield alone
    finally:
        bpy.data.batch_remove(alone.copies)


def _cut_loose(
    tree: bpy.types.NodeTree, name: str, alone: StandAlone, groups: dict[bpy.types.NodeTree, bpy.types.NodeTree]
) -> None:
    tree.animation_data_clear()
    for node in tree.nodes:
        for own in node.bl_rna.properties:
            value = getattr(node, own.identifier) if own.type == "POINTER" else None
            if isinstance(value, bpy.types.Object):
                matrix = [list(row) for row in value.matrix_world]
                reference = {"tree": name, "node": node.name, "property": own.identifier, "matrix": matrix}
                alone.objects.append(reference)
                setattr(node, own.identifier, None)
        group = node.node_tree if node.type == "GROUP" else None
        if group is None:
            continue
        if group not in groups:
            groups[group] = group.copy()
            alone.copies.append(groups[group])
            _cut_loose(groups[group], groups[group].name, alone, groups)
        node.node_tree = groups[group]
