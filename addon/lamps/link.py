# SPDX-License-Identifier: GPL-3.0-or-later
"""Light linking: which objects a lamp does not light."""

import bpy

from .pack import property_name

# On an object: 1 where light linking keeps the lamp from it.
UNLINKED = "unlinked"


def mark_unlinked(scene: bpy.types.Scene, index: int, lamp: bpy.types.Object) -> None:
    """Light linking: mark the objects that the lamp does not light. Its list may name those lit, or those not."""
    name = property_name(index, UNLINKED)
    receivers = lamp.light_linking.receiver_collection
    for mesh in scene.objects:
        if receivers is not None and mesh.type != "LIGHT" and not _receives(receivers, mesh):
            mesh[name] = 1.0
        elif name in mesh:
            del mesh[name]


def _receives(receivers: bpy.types.Collection, mesh: bpy.types.Object) -> bool:
    states = {}
    for item, entry in zip(receivers.objects, receivers.collection_objects, strict=True):
        states[item] = entry.light_linking.link_state
    for child, entry in zip(receivers.children, receivers.collection_children, strict=True):
        for item in child.all_objects:
            states.setdefault(item, entry.light_linking.link_state)
    if mesh in states:
        return states[mesh] == "INCLUDE"
    # As Blender has it: a list that includes nobody leaves out just whom it excludes.
    return "INCLUDE" not in states.values() and bool(states)
