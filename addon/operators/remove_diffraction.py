# SPDX-License-Identifier: GPL-3.0-or-later
"""Removes diffraction from the selected objects."""

import bpy

from ...precompute.base.failure import GratingError
from .polls import in_object_mode
from .reports import report_failure, report_lines


class RemoveDiffraction(bpy.types.Operator):
    """Remove diffraction from the selected objects and restore their former materials. Other objects keep it"""

    bl_idname = "grating.remove_diffraction"
    bl_label = "Remove from Materials"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        from ..workflow.removing import slots_with_diffraction

        if not in_object_mode(cls, context):
            return False
        if not any(slots_with_diffraction(thing) for thing in context.selected_objects):
            cls.poll_message_set("Select a mesh whose material has diffraction")
            return False
        return True

    def execute(self, context):
        from ..workflow.removing import remove_from

        try:
            return report_lines(self, [remove_from(context.selected_objects)])
        except GratingError as error:
            return report_failure(self, error)
