# SPDX-License-Identifier: GPL-3.0-or-later
"""Removes a grating from the scene's list."""

import bpy

from .shared import has_grating


class RemoveGrating(bpy.types.Operator):
    """Remove the active grating from the list. Its materials and its bake stay"""

    bl_idname = "grating.remove"
    bl_label = "Remove Grating"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return has_grating(cls, context)

    def execute(self, context):
        from ..workflow.fitting_worlds import forget_unread_sources

        gratings = context.scene.natural_gratings
        gratings.items.remove(gratings.active_index)
        gratings.active_index = min(gratings.active_index, max(len(gratings.items) - 1, 0))
        forget_unread_sources()
        return {"FINISHED"}
