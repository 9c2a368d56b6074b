# SPDX-License-Identifier: GPL-3.0-or-later
"""Remove diffraction from the materials of the selected meshes."""

import bpy


class RemoveDiffraction(bpy.types.Operator):
    """Remove diffraction from the selected meshes' materials and leave the materials as they were before"""

    bl_idname = "grating.remove_diffraction"
    bl_label = "Remove from Materials"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        from ..actions.assign import materials_with_diffraction

        if not materials_with_diffraction(context.selected_objects):
            cls.poll_message_set("Select a mesh whose material has diffraction")
            return False
        return True

    def execute(self, context):
        from ..actions.assign import remove_from

        self.report({"INFO"}, remove_from(context.selected_objects))
        return {"FINISHED"}
