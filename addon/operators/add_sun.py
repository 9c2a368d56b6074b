# SPDX-License-Identifier: GPL-3.0-or-later
"""Add a sun to a scene that has no lamp."""

import bpy

from ..workflow.following_lamps import add_sun, update_lamps


class AddSun(bpy.types.Operator):
    """Add a sun that lights the scene, slanting from above"""

    bl_idname = "grating.add_sun"
    bl_label = "Add Sun"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        sun = add_sun(context.scene)
        update_lamps(context.scene)
        self.report({"INFO"}, f"{sun.name}: lights the scene")
        return {"FINISHED"}
