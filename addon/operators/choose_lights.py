# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses which lights the active grating responds to."""

import bpy
from bpy.props import EnumProperty

from ...precompute.base.failure import GratingError
from ..gratings.grating import active_grating
from ..gratings.lights_choice import LIGHTS
from .polls import has_grating
from .reports import report_failure


class ChooseLights(bpy.types.Operator):
    """Choose which lights the materials of the active grating respond to"""

    bl_idname = "grating.lights"
    bl_label = "Lights"
    bl_options = {"REGISTER", "UNDO"}

    lights: EnumProperty(name="Lights", description="Lights that the diffraction responds to", items=LIGHTS)

    @classmethod
    def poll(cls, context):
        return has_grating(cls, context)

    def execute(self, context):
        from ..workflow.making_materials import choose_lights

        try:
            warnings = choose_lights(active_grating(context.scene), self.lights)
        except GratingError as error:
            return report_failure(self, error)
        for line in warnings:
            self.report({"WARNING"}, line)
        return {"FINISHED"}
