# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds the active grating's diffraction to the materials of the selected meshes, and removes diffraction from
selected objects."""

import bpy

from ...precompute.base.failure import GratingError
from .shared import OnSelectedMeshes, in_object_mode, report_failure, report_lines


class AddDiffraction(OnSelectedMeshes, bpy.types.Operator):
    """Add the active grating's diffraction on top of all materials of the selected meshes, in place of any other
    diffraction"""

    bl_idname = "grating.add_diffraction"
    bl_label = "Add to Materials"
    bl_options = {"REGISTER", "UNDO"}

    def put(self, scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> list[str]:
        from ..workflow.assigning import add_to_meshes

        return add_to_meshes(scene, objects)


class RemoveDiffraction(bpy.types.Operator):
    """Remove diffraction from the selected objects and restore their former materials. Other objects keep it"""

    bl_idname = "grating.remove_diffraction"
    bl_label = "Remove from Materials"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        from ..workflow.assigning import slots_with_diffraction

        if not in_object_mode(cls, context):
            return False
        if not any(slots_with_diffraction(thing) for thing in context.selected_objects):
            cls.poll_message_set("Select a mesh whose material has diffraction")
            return False
        return True

    def execute(self, context):
        from ..workflow.assigning import remove_from

        try:
            return report_lines(self, [remove_from(context.selected_objects)])
        except GratingError as error:
            return report_failure(self, error)
