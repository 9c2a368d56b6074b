# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows or hides the direction of the active object's grating in the 3D views."""

import bpy

from .follows_job import redraw_views


class ShowDirection(bpy.types.Operator):
    """Show the direction of the active object's grating: arrows along the scan's x axis (left to right), red lines at
    UV seams where it jumps, and yellow rings where a comb has no direction"""

    bl_idname = "grating.show_direction"
    bl_label = "Show Direction"
    bl_options = {"INTERNAL"}

    # Whether the direction is shown. The panel's button reads this without loading the drawing code.
    on = False
    # The error if drawing failed and the overlay switched itself off.
    fault = ""

    @classmethod
    def poll(cls, context):
        if bpy.app.background:
            cls.poll_message_set("Open Blender with a window: only a 3D view shows the direction")
            return False
        return True

    def execute(self, context):
        set_shown(not ShowDirection.on)
        redraw_views(context)
        return {"FINISHED"}


def set_shown(on: bool) -> None:
    """Switch the overlay on or off."""
    if on != ShowDirection.on:
        from ..workflow.direction_overlay import show

        show(on, _note_fault)
        ShowDirection.on, ShowDirection.fault = on, ""


def _note_fault(line: str) -> None:
    """Record why the overlay switched itself off; the panel shows it."""
    ShowDirection.on, ShowDirection.fault = False, line
    redraw_views(bpy.context)
