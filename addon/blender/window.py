# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's windows: whether there are any, and drawing their 3D views anew."""

import bpy


def has_window() -> bool:
    """Whether Blender runs with windows, so that timers run and panels are drawn."""
    return not bpy.app.background


def redraw_views() -> None:
    """Have Blender draw the 3D views of all windows anew, with their sidebars."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
