# SPDX-License-Identifier: GPL-3.0-or-later
"""What the running Blender does: its windows and their 3D views, its renders, and the time of the last change."""

import time
from contextlib import AbstractContextManager
from typing import Any

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


def is_rendering() -> bool:
    """Whether a render or a texture bake is running in a background thread. It may read any data, so none may change
    meanwhile."""
    running: Any = bpy.app.is_job_running  # the stubs say it returns None
    return bool(running("RENDER") or running("OBJECT_BAKE"))


# Seconds without a change after which a drag counts as paused or ended, and slow results are computed again.
STILL = 0.2
_count, _last = 0, 0.0


def note_change() -> None:
    """Note a change; called by Blender's handlers."""
    global _count, _last
    _count, _last = _count + 1, time.monotonic()


def change_count() -> int:
    """The number of changes that Blender reported. A result is up to date while this number stays the same."""
    return _count


def seconds_until_still() -> float:
    """Seconds until nothing has changed for STILL seconds; 0 if that is already so."""
    return max(0.0, _last + STILL - time.monotonic())
