# SPDX-License-Identifier: GPL-3.0-or-later
"""Light linking: an object is marked with the followed lamps that do not light it, and nodes read the marks."""

import bpy

from ..nodes.builder import Tree, Value
from .brightest_lamps import LAMPS_MAX
from .lamp_drivers import property_name

# Custom property of an object: 1 if light linking excludes the lamp for the object.
_UNLINKED = "unlinked"


def mark_unlinked(scene: bpy.types.Scene, lamps: list[bpy.types.Object]) -> None:
    """Mark each object of the scene with the indices of the lamps that do not light it, and clear all other marks."""
    receivers = [lamp.light_linking.receiver_collection for lamp in lamps]
    names = [property_name(index, _UNLINKED) for index in range(LAMPS_MAX)]
    for thing in scene.collection.all_objects:
        present = [name for name in names if name in thing]
        wanted = []
        if thing.type != "LIGHT":
            wanted = [names[i] for i, listed in enumerate(receivers) if listed and not receives(listed, thing)]
        if present != wanted:
            for name in set(present) - set(wanted):
                del thing[name]
            for name in set(wanted) - set(present):
                thing[name] = 1.0
            thing.update_tag()


def is_linked(lamp: bpy.types.Object) -> bool:
    """Whether the lamp has a light linking list."""
    return lamp.light_linking.receiver_collection is not None


def read_unlinked(tree: Tree, index: int) -> Value:
    """1 on an object that the lamp does not light, else 0."""
    mark, _ = tree.attribute(property_name(index, _UNLINKED), "OBJECT")
    return tree.dot(mark, (1.0, 0.0, 0.0))


def is_unlinked(thing: bpy.types.Object, index: int) -> bool:
    """Whether an object is marked as not lit by the lamp with this index."""
    return property_name(index, _UNLINKED) in thing


def receives(receivers: bpy.types.Collection, mesh: bpy.types.Object) -> bool:
    """Whether a lamp with this list of receivers lights the object. Entries of the list include or exclude objects."""
    states = {}
    for item, entry in zip(receivers.objects, receivers.collection_objects, strict=True):
        states[item] = entry.light_linking.link_state
    for child, listed in zip(receivers.children, receivers.collection_children, strict=True):
        for item in child.all_objects:
            states.setdefault(item, listed.light_linking.link_state)
    if mesh in states:
        return states[mesh] == "INCLUDE"
    # As in Blender, a list that only excludes objects lets the lamp light all others.
    return "INCLUDE" not in states.values() and bool(states)
