# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds a sun to a scene without lamps."""

import bpy

from ..workflow.following_lamps import add_sun, update_lamps


class AddSun(bpy.types.Operator):
    """Add a sun lamp that shines at an angle from above"""

    bl_idname = "grating.add_sun"
    bl_label = "Add Sun"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        sun = add_sun(context.scene)
        update_lamps(context.scene)
        self.report({"INFO"}, f"{sun.name}: lights the scene")
        return {"FINISHED"}
