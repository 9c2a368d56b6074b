# SPDX-License-Identifier: GPL-3.0-or-later
"""Assigns the active grating's material to the selected meshes."""

import bpy

from .shared import OnSelectedMeshes


class AssignToSelected(OnSelectedMeshes, bpy.types.Operator):
    """Put the active grating's material into the active material slot of the selected meshes. The scan's x axis (left
    to right) follows the direction set by Direction"""

    bl_idname = "grating.assign"
    bl_label = "Assign to Selected"
    bl_options = {"REGISTER", "UNDO"}

    def put(self, scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> list[str]:
        from ..workflow.assigning import assign_to_meshes

        return assign_to_meshes(scene, objects)
