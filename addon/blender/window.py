# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's windows: whether any exist, and redrawing their 3D views."""

import bpy


def has_window() -> bool:
    """Whether Blender has windows. Only then do timers run and panels draw."""
    return not bpy.app.background


def redraw_views() -> None:
    """Redraw the 3D views of all windows, with their sidebars."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
