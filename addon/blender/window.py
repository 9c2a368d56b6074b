# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's windows: whether any exist, running in one, and redrawing their 3D views."""

from contextlib import AbstractContextManager

import bpy


def has_window() -> bool:
    """Whether Blender has windows. Only then do timers run and panels draw."""
    return not bpy.app.background


def in_window() -> AbstractContextManager[object]:
    """The context of a window of the open file, in which Blender runs scripts too. Once a file is open, a command has
    none, and without one operators and members such as `active_object` are missing."""
    context = bpy.context
    of_scene = (window for window in context.window_manager.windows if window.scene == context.scene)
    return context.temp_override(window=context.window or next(of_scene, None))


def redraw_views() -> None:
    """Redraw the 3D views of all windows, with their sidebars."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
