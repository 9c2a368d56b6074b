# SPDX-License-Identifier: GPL-3.0-or-later
"""Show or hide the direction of the active object's grating in the 3D views."""

import bpy


class ShowDirection(bpy.types.Operator):
    """Show the direction of the active object's grating: arrows along the scan's columns, and in red the seams where
    its UV map turns them"""

    bl_idname = "grating.show_direction"
    bl_label = "Show Direction"
    bl_options = {"INTERNAL"}

    # Whether it is shown. The panel's button says so without loading what draws it.
    on = False

    @classmethod
    def poll(cls, context):
        if bpy.app.background:
            cls.poll_message_set("There is no 3D view in background")
            return False
        return True

    def execute(self, context):
        set_shown(not ShowDirection.on)
        for window in context.window_manager.windows:
            for area in window.screen.areas:
                if area.type == "VIEW_3D":
                    area.tag_redraw()
        return {"FINISHED"}


def set_shown(on: bool) -> None:
    """Switch the overlay on or off."""
    if on != ShowDirection.on:
        from ..actions.overlay import show

        show(on)
        ShowDirection.on = on
