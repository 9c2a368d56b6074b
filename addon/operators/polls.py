# SPDX-License-Identifier: GPL-3.0-or-later
"""Conditions of the operators' buttons. If one is not met, the disabled button's tooltip says what is missing."""

from typing import TYPE_CHECKING

import bpy

Operator = type[bpy.types.Operator]
# The base of classes that only operators inherit. Only the type checker sees it as an operator, because Blender
# registers the classes that inherit it.
if TYPE_CHECKING:
    OperatorMixin = bpy.types.Operator
else:
    OperatorMixin = object


def in_object_mode(operator: Operator, context: bpy.types.Context) -> bool:
    """Whether Blender is in Object Mode. In Edit Mode a mesh's faces and UV maps cannot be read."""
    if context.mode != "OBJECT":
        operator.poll_message_set("Switch to Object Mode first")
        return False
    return True


def has_grating(operator: Operator, context: bpy.types.Context) -> bool:
    """Whether the scene has an active grating."""
    if context.scene.natural_gratings.active() is None:
        operator.poll_message_set("Add a grating first: import a scan, or choose a preset")
        return False
    return True


def has_bake(operator: Operator, context: bpy.types.Context) -> bool:
    """Whether the active grating is baked."""
    if not has_grating(operator, context):
        return False
    if not context.scene.natural_gratings.active().bake_path:
        operator.poll_message_set("Bake the grating first")
        return False
    return True


def has_active_mesh(operator: Operator, context: bpy.types.Context) -> bool:
    """Whether the active object is a mesh."""
    if context.active_object is None or context.active_object.type != "MESH":
        operator.poll_message_set("Make a mesh the active object first")
        return False
    return True


def selected_meshes(context: bpy.types.Context) -> list[bpy.types.Object]:
    """The meshes among the selected objects."""
    return [thing for thing in context.selected_objects if thing.type == "MESH"]


def has_selected_mesh(operator: Operator, context: bpy.types.Context) -> bool:
    """Whether a mesh is among the selected objects."""
    if not selected_meshes(context):
        from ..workflow.chosen_meshes import no_meshes

        operator.poll_message_set("; ".join(no_meshes(context.selected_objects)) or "Select a mesh first")
        return False
    return True
