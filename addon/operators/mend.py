# SPDX-License-Identifier: GPL-3.0-or-later
"""Repairs diffraction materials with lost parts."""

import bpy

from ...precompute.base.failure import GratingError
from .shared import report_failure, report_lines


class MendMaterials(bpy.types.Operator):
    """Rebuild deleted, unpacked or edited pictures and node groups of diffraction materials from their bakes"""

    bl_idname = "grating.mend"
    bl_label = "Mend Materials"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        from ..workflow.adopting import mend_materials

        try:
            return report_lines(self, mend_materials())
        except GratingError as error:
            return report_failure(self, error)
