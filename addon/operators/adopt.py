# SPDX-License-Identifier: GPL-3.0-or-later
"""Adopts diffraction materials that belong to no grating in the list."""

import bpy

from ...precompute.base.failure import GratingError
from ..materials.group_properties import is_diffraction
from .shared import report_failure, report_lines


class AdoptMaterials(bpy.types.Operator):
    """Bring appended and pasted diffraction materials into the list. A copy of a grating in the list follows that
    grating from now on; each other material becomes a separate grating"""

    bl_idname = "grating.adopt"
    bl_label = "Adopt"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        # The panel draws the button only if there is something to adopt. Blender calls this at each redraw.
        if not any(map(is_diffraction, bpy.data.node_groups)):
            cls.poll_message_set("Append or paste a diffraction material first")
            return False
        return True

    def execute(self, context):
        from ..workflow.adopting import adopt

        try:
            return report_lines(self, adopt(context.scene))
        except GratingError as error:
            return report_failure(self, error)
