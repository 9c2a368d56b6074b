# SPDX-License-Identifier: GPL-3.0-or-later
"""Light linking: which objects a lamp does not light, marked on the objects and read by nodes."""

import bpy

from ..nodes.builder import Tree, Value
from .pack import property_name

# A custom property of an object: 1 where light linking keeps the lamp from the object.
_UNLINKED = "unlinked"


def mark_unlinked(scene: bpy.types.Scene, index: int, lamp: bpy.types.Object) -> None:
    """Mark the scene's objects that the lamp does not light, and clear the mark on all others."""
    name = property_name(index, _UNLINKED)
    receivers = lamp.light_linking.receiver_collection
    for mesh in scene.objects:
        if receivers is not None and mesh.type != "LIGHT" and not _receives(receivers, mesh):
            mesh[name] = 1.0
        elif name in mesh:
            del mesh[name]


def is_linked(index: int) -> bool:
    """Whether some object of the file has the mark for this lamp."""
    name = property_name(index, _UNLINKED)
    return any(name in thing for thing in bpy.data.objects)


def read_unlinked(tree: Tree, index: int) -> Value:
    """1 on an object that the lamp does not light, else 0."""
    mark, _ = tree.attribute(property_name(index, _UNLINKED), "OBJECT")
    return tree.dot(mark, (1.0, 0.0, 0.0))


def _receives(receivers: bpy.types.Collection, mesh: bpy.types.Object) -> bool:
    """Whether a lamp with this list of receivers lights the object. The list names objects to light, or not to."""
    states = {}
    for item, entry in zip(receivers.objects, receivers.collection_objects, strict=True):
        states[item] = entry.light_linking.link_state
    for child, entry in zip(receivers.children, receivers.collection_children, strict=True):
        for item in child.all_objects:
            states.setdefault(item, entry.light_linking.link_state)
    if mesh in states:
        return states[mesh] == "INCLUDE"
    # As in Blender, a lamp whose list only excludes objects lights every object that the list does not name.
    return "INCLUDE" not in states.values() and bool(states)
