# SPDX-License-Identifier: GPL-3.0-or-later
"""Switching between an artist's scene and a scene of Show Me, and how the 3D views look in each, also after undo, which
changes the scene of a window but leaves its 3D views as they are."""

from typing import Literal, NamedTuple

import bpy
from mathutils import Matrix

from ..blender.session import has_window

# Names the scenes of Show Me, by a custom property.
MARK = "ng_show"
# How closely the camera's frame fills a 3D view of Show Me.
_ZOOM = 14.0


class _View(NamedTuple):
    """How a 3D view looked before Show Me changed it."""

    space: bpy.types.SpaceView3D
    matrix: Matrix
    shading: Literal["WIREFRAME", "SOLID", "MATERIAL", "RENDERED"]
    perspective: Literal["PERSP", "ORTHO", "CAMERA"]
    zoom: float


class _Before(NamedTuple):
    """The artist's scene by its name, and how the 3D views looked in it."""

    scene: str
    views: list[_View]


_before: _Before | None = None
# The name of the scene in each window before an undo, and whether it is one of Show Me.
_noted: dict[bpy.types.Window, tuple[str, bool]] = {}


def is_show(scene: bpy.types.Scene) -> bool:
    """Whether Show Me made the scene."""
    return bool(scene.get(MARK))


def scene_before(context: bpy.types.Context) -> bpy.types.Scene | None:
    """The artist's scene: the one that was open before Show Me, else the file's first other scene."""
    named = bpy.data.scenes.get(_before.scene) if _before else None
    own = [scene for scene in bpy.data.scenes if not is_show(scene) and scene != context.scene]
    return named if named in own else next(iter(own), None)


def switch_to(context: bpy.types.Context, scene: bpy.types.Scene) -> None:
    """Show a scene in the context's window. A scene of Show Me is shown rendered through its camera; in the artist's
    scene the 3D views look as they did before."""
    if has_window():
        former = context.window.scene
        context.window.scene = scene
        _change_views(context.window, former.name, was_show=is_show(former))


def note_scenes() -> None:
    """Before an undo or a redo."""
    _noted.clear()
    for window in bpy.context.window_manager.windows if has_window() else ():
        _noted[window] = window.scene.name, is_show(window.scene)


def follow_scenes() -> None:
    """After an undo or a redo."""
    for window in bpy.context.window_manager.windows if has_window() else ():
        name, was_show = _noted.get(window, (window.scene.name, is_show(window.scene)))
        if is_show(window.scene) != was_show:
            _change_views(window, name, was_show=was_show)


def _change_views(window: bpy.types.Window, former: str, *, was_show: bool) -> None:
    """Let a window's 3D views look as its scene asks, after the scene with the name `former`."""
    global _before
    views = _views(window)
    if is_show(window.scene):
        if not was_show:
            _before = _Before(former, [_look_of(view) for view in views])
        for view in views:
            view.region_3d.view_perspective, view.shading.type = "CAMERA", "RENDERED"
            view.region_3d.view_camera_zoom, view.region_3d.view_camera_offset = _ZOOM, (0.0, 0.0)
        return
    for kept in _before.views if _before else ():
        if kept.space in views:
            region = kept.space.region_3d
            kept.space.shading.type, region.view_perspective = kept.shading, kept.perspective
            region.view_camera_zoom = kept.zoom
            if kept.perspective != "CAMERA":
                region.view_matrix = kept.matrix
    _before = None


def _look_of(view: bpy.types.SpaceView3D) -> _View:
    region = view.region_3d
    return _View(view, region.view_matrix.copy(), view.shading.type, region.view_perspective, region.view_camera_zoom)


def _views(window: bpy.types.Window) -> list[bpy.types.SpaceView3D]:
    """The 3D views of a window."""
    spaces = (area.spaces.active for area in window.screen.areas)
    return [space for space in spaces if isinstance(space, bpy.types.SpaceView3D)]
