# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds the active grating's diffraction to the materials of the selected meshes."""

import bpy

from .on_selected_meshes import OnSelectedMeshes


class AddDiffraction(OnSelectedMeshes, bpy.types.Operator):
    """Add the active grating's diffraction on top of all materials of the selected meshes, in place of any other
    diffraction"""

    bl_idname = "grating.add_diffraction"
    bl_label = "Add to Materials"
    bl_options = {"REGISTER", "UNDO"}

    def put(self, scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> list[str]:
        from ..workflow.assigning import add_to_meshes

        return add_to_meshes(scene, objects)
