# SPDX-License-Identifier: GPL-3.0-or-later
"""Have diffraction follow the lamps that the scene has now."""

import bpy

from ...precompute.base.failure import GratingError
from ..actions.lamps import update_lamps, warnings_about
from .report import report_failure


class UpdateLights(bpy.types.Operator):
    """Have diffraction follow the lamps that the scene has now. Needed after lamps were added or removed, became
    another kind, moved between collections or were linked to objects; every other change of a lamp is followed by
    itself"""

    bl_idname = "grating.update_lights"
    bl_label = "Update Lights"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            lamps = update_lamps(context.scene)
        except GratingError as error:
            return report_failure(self, error)
        self.report({"INFO"}, f"lit by {', '.join(lamp.name for lamp in lamps)}")
        for line in warnings_about(context.scene, context.evaluated_depsgraph_get()):
            self.report({"WARNING"}, line)
        return {"FINISHED"}
