# SPDX-License-Identifier: GPL-3.0-or-later
"""Assign the active grating's material to the selected meshes."""

import bpy

from ..actions.assign import assign_to_meshes
from .on_selected_meshes import OnSelectedMeshes


class AssignToSelected(OnSelectedMeshes, bpy.types.Operator):
    """Put the active grating's material (made if need be) on the selected meshes; the grating's columns run along U"""

    bl_idname = "grating.assign"
    bl_label = "Assign to Selected"
    bl_options = {"REGISTER", "UNDO"}

    def put(self, scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> str:
        return assign_to_meshes(scene, objects)
