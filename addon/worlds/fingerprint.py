# SPDX-License-Identifier: GPL-3.0-or-later
"""A fingerprint of a world that changes when its light may have changed, computed from its nodes without a render."""

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import bpy

from ..blender import compat

# Properties of all nodes, such as their place in the editor; of these, only muting changes the light.
_OF_ALL_NODES = {own.identifier for own in bpy.types.Node.bl_rna.properties} - {"mute"}
# The current frame of an image user, ignored because it advances for still pictures too.
_FRAME = "frame_current"
_PLAIN = {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}


def fingerprint(world: bpy.types.World, blocks: set[bpy.types.ID] | None = None) -> str:
    """The fingerprint of the world's nodes at the current frame: links, values, pictures (name, file name, size,
    whether painted on), mappings, curves, ramps, and the positions of referenced objects.

    It does not detect further strokes on a painted picture, a file that another program writes with the same size, or
    the frames of a movie. Adds the data-blocks that the fingerprint depends on to `blocks`."""
    seen = set() if blocks is None else blocks
    seen.add(world)
    facts = [compat.working_space(), tuple(world.color), world.cycles_visibility.glossy]
    facts += _tree_facts(compat.world_nodes(world), seen)
    return hashlib.sha256(repr(facts).encode()).hexdigest()


def _tree_facts(tree: bpy.types.NodeTree | None, seen: set[bpy.types.ID]) -> Iterator[object]:
    if tree is None or tree in seen:
        return
    seen.add(tree)
    for node in sorted(tree.nodes, key=lambda node: node.name):
        yield node.name, node.bl_idname
        for own in node.bl_rna.properties:
            if own.identifier not in _OF_ALL_NODES:
                yield own.identifier, list(_facts(node, own, seen))
        for socket in (*node.inputs, *node.outputs):
            value: Any = getattr(socket, "default_value", None)
            yield tuple(value) if hasattr(value, "__len__") and not isinstance(value, str) else value
    for link in tree.links:
        yield link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier


def _file_facts(image: bpy.types.Image) -> tuple[str, int]:
    """The name of a picture's file, and its size in bytes. Its folder differs between machines, so it is ignored."""
    if image.packed_file is not None:
        size = image.packed_file.size
    else:
        path = Path(bpy.path.abspath(image.filepath, library=image.library))
        size = path.stat().st_size if image.filepath and path.is_file() else 0
    return bpy.path.basename(image.filepath), size


def _facts(owner: bpy.types.bpy_struct, own: bpy.types.Property, seen: set[bpy.types.ID]) -> Iterator[object]:
    """The values of one property and of everything in it. Adds the data-blocks on the way to `seen`."""
    if own.identifier in ("rna_type", _FRAME):
        return
    value = getattr(owner, own.identifier)
    if isinstance(value, bpy.types.ID) and not isinstance(value, bpy.types.NodeTree):
        seen.add(value)
    if own.type in _PLAIN:
        yield tuple(value) if getattr(own, "is_array", False) else value
    elif isinstance(value, bpy.types.Image):
        yield value.name_full, *_file_facts(value)
        if value.source == "GENERATED" or value.is_dirty:  # for other pictures, Blender would load the whole file
            yield tuple(value.size)
        yield value.is_dirty, value.source, value.colorspace_settings.name, value.alpha_mode
    elif isinstance(value, bpy.types.NodeTree):
        yield value.name_full, list(_tree_facts(value, seen))
    elif isinstance(value, bpy.types.Object):
        yield value.name_full, [tuple(row) for row in value.matrix_world]
    elif isinstance(value, bpy.types.Text):
        yield value.as_string()
    elif isinstance(value, bpy.types.ID):
        yield value.name_full
    elif value is not None:
        for part in value if own.type == "COLLECTION" else (value,):
            for inner in part.bl_rna.properties:
                yield inner.identifier, list(_facts(part, inner, seen))
