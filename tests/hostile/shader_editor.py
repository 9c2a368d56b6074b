# SPDX-License-Identifier: GPL-3.0-or-later
"""A shader editor in a Blender without a window, for operators that need one."""

from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def shader_editor() -> Iterator[object]:
    """Turn an editor of the first window into a shader editor, as context and as value, and back at the end. It shows
    the active object's active material."""
    import bpy

    window = bpy.context.window_manager.windows[0]
    area = max(window.screen.areas, key=lambda each: each.width * each.height)
    before, area.ui_type = area.ui_type, "ShaderNodeTree"
    region = next(each for each in area.regions if each.type == "WINDOW")
    try:
        space = area.spaces.active
        space.shader_type, space.pin = "OBJECT", False  # an opened file may have another
        with bpy.context.temp_override(window=window, area=area, region=region):
            yield space
    finally:
        area.ui_type = before
