# SPDX-License-Identifier: GPL-3.0-or-later
"""Leaves a lamp out of the diffraction, or keeps it in."""

import bpy
from bpy.props import StringProperty

from ...precompute.base.failure import GratingError
from .reports import report_failure, report_lines


class CountLamp(bpy.types.Operator):
    """Light the diffraction with this lamp. A lamp that is left out still lights everything else, and costs almost
    nothing. Its white mirror image stays, except with Lamps Only. With All by Samples every lamp counts"""

    bl_idname = "grating.count_lamp"
    bl_label = "Lamp Lights Diffraction"
    bl_options = {"REGISTER", "UNDO"}

    # SKIP_SAVE: from a menu it is the active object, not the lamp of the last call.
    lamp: StringProperty(name="Lamp", description="The lamp's name. Empty: the active object", options={"SKIP_SAVE"})

    def execute(self, context):
        from ..workflow.counting_lamps import count_lamp

        try:
            return report_lines(self, count_lamp(context.scene, self.lamp, context.active_object))
        except GratingError as error:
            return report_failure(self, error)
