# SPDX-License-Identifier: GPL-3.0-or-later
"""Choose which lights the active grating answers to."""

import bpy
from bpy.props import EnumProperty

from ...precompute.base.failure import GratingError
from ..scene.gratings import active_grating
from ..scene.lights import LIGHTS
from .polls import has_grating
from .report import report_failure


class ChooseLights(bpy.types.Operator):
    """Choose which lights the materials of the active grating show"""

    bl_idname = "grating.lights"
    bl_label = "Lights"
    bl_options = {"REGISTER", "UNDO"}

    lights: EnumProperty(name="Lights", description="Which lights the diffraction shows", items=LIGHTS)

    @classmethod
    def poll(cls, context):
        return has_grating(cls, context)

    def execute(self, context):
        from ..actions.material import choose_lights

        try:
            warnings = choose_lights(active_grating(context.scene), self.lights)
        except GratingError as error:
            return report_failure(self, error)
        for line in warnings:
            self.report({"WARNING"}, line)
        return {"FINISHED"}
