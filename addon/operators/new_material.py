# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes a diffraction material from the active grating's bake."""

import bpy

from ...precompute.base.failure import GratingError
from ..gratings.grating import active_grating
from .shared import has_bake, report_failure, report_lines


class NewDiffractionMaterial(bpy.types.Operator):
    """Make a new material from the active grating's bake, lit by the scene's lamps. Assign it to a mesh yourself"""

    bl_idname = "grating.new_material"
    bl_label = "New Diffraction Material"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return has_bake(cls, context)

    def execute(self, context):
        from ..workflow.making_materials import make_material

        try:
            material = make_material(context.scene, active_grating(context.scene))
        except GratingError as error:
            return report_failure(self, error)
        return report_lines(self, [f"{material.name}: assign it to a mesh"])
