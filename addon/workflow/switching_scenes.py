# SPDX-License-Identifier: GPL-3.0-or-later
"""Switching a window between the artist's scene and the scenes of Show Me."""

from typing import Literal, NamedTuple

import bpy
from mathutils import Matrix

from ..blender.window import has_window
from .showing import is_show

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


def scene_before(context: bpy.types.Context) -> bpy.types.Scene | None:
    """The artist's scene: the one that was open before Show Me, else the file's first other scene."""
    named = bpy.data.scenes.get(_before.scene) if _before else None
    own = [scene for scene in bpy.data.scenes if not is_show(scene) and scene != context.scene]
    return named if named in own else next(iter(own), None)


def switch_to(context: bpy.types.Context, scene: bpy.types.Scene) -> None:
    """Show a scene in the context's window. A scene of Show Me is shown rendered through its camera; in the artist's
    scene the 3D views look as they did before."""
    global _before
    if not has_window():
        return
    views = _views(context.window)
    if is_show(scene):
        if not is_show(context.window.scene):
            kept = [_look_of(view) for view in views]
            _before = _Before(context.window.scene.name, kept)
        context.window.scene = scene
        for view in views:
            view.region_3d.view_perspective, view.shading.type = "CAMERA", "RENDERED"
            view.region_3d.view_camera_zoom, view.region_3d.view_camera_offset = _ZOOM, (0.0, 0.0)
        return
    context.window.scene = scene
    for former in _before.views if _before else ():
        if former.space in views:
            region = former.space.region_3d
            former.space.shading.type, region.view_perspective = former.shading, former.perspective
            region.view_camera_zoom = former.zoom
            if former.perspective != "CAMERA":
                region.view_matrix = former.matrix
    _before = None


def _look_of(view: bpy.types.SpaceView3D) -> _View:
    region = view.region_3d
    return _View(view, region.view_matrix.copy(), view.shading.type, region.view_perspective, region.view_camera_zoom)


def _views(window: bpy.types.Window) -> list[bpy.types.SpaceView3D]:
    """The 3D views of a window."""
    spaces = (area.spaces.active for area in window.screen.areas)
    return [space for space in spaces if isinstance(space, bpy.types.SpaceView3D)]
