# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffraction groups in .blend files that an earlier version of the extension saved.

Their responses have one input more, "Energy Conserving". This version cannot read their bakes. But the .blend holds
their nodes and pictures, so such a response stays as it was saved until a new bake replaces it."""

import bpy

from ..nodes.interface import INPUT, sockets_of
from .response import is_response

FAULT = "made by an earlier version of this extension, and shown as saved"
REMEDY = "to renew it, press Bake Grating, then Assign to Selected"
_INPUT = "Energy Conserving"


def is_of_earlier_version(group: bpy.types.NodeTree) -> bool:
    """Whether an earlier version made a Diffraction group, or a response in it."""
    return bool(_own_inputs(group) or _earlier(group))


def keep_earlier_input(group: bpy.types.NodeTree) -> None:
    """Link the earlier responses in a refilled Diffraction group to the group's own input, so that they show as before.
    If a new bake has replaced all of them, remove the input."""
    earlier = _earlier(group)
    if earlier and _own_inputs(group):
        (given,) = (node.outputs[_INPUT] for node in group.nodes if node.type == "GROUP_INPUT")
        for node in earlier:
            group.links.new(given, node.inputs[_INPUT])
        return
    for item in _own_inputs(group):
        group.interface.remove(item)


def _earlier(group: bpy.types.NodeTree) -> list[bpy.types.Node]:
    return [node for node in group.nodes if is_response(node) and _INPUT in node.inputs]


def _own_inputs(group: bpy.types.NodeTree) -> list[bpy.types.NodeTreeInterfaceSocket]:
    return [item for item in sockets_of(group, INPUT) if item.name == _INPUT]
