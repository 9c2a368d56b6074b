# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays through the pixels of a 3D view."""

import bpy
import numpy as np

from ...precompute.base.failure import GratingError
from .camera_rays import Pixels

# The height of a 3D view's picture in pixels, where only its shape matters.
_HIGH = 1000
# The rays of an orthographic view begin this far behind its middle, in metres: the view shows what is behind it too.
_BEHIND = 1e3


class ViewPixels(Pixels):
    """Converts the pixels of a 3D view, which has a size in pixels, to rays into the scene. Without a size, the picture
    has the view's shape."""

    def __init__(self, view: bpy.types.RegionView3D, size: tuple[int, int] | None = None) -> None:
        place, projection = np.array(view.view_matrix.inverted_safe()), np.array(view.window_matrix)
        is_flat = projection[3, 3] != 0
        self._kind = "ORTHO" if is_flat else "PERSP"
        self._axes = place[:3, :3]
        self._origin = place[:3, 3] + (_BEHIND * self._axes[:, 2] if is_flat else 0.0)
        # The frame at a depth of 1, from the projection that maps it to -1 to 1.
        shift = -projection[:2, 3] if is_flat else projection[:2, 2]
        scale = np.array([projection[0, 0], projection[1, 1]])
        self._corner = np.array([*(shift - 1) / scale, -1.0])
        self._span = np.array([*2 / scale, 0.0])
        self.size = size or (max(1, round(_HIGH * scale[1] / scale[0])), _HIGH)


def seen_from(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, view: bpy.types.RegionView3D | None, *, from_view: bool
) -> Pixels:
    """The picture of the scene's camera, or of a 3D view if asked or if there is no camera. Raises GratingError if
    there is neither."""
    if from_view and view is not None:
        return ViewPixels(view)
    if scene.camera is not None and scene.camera.type == "CAMERA":
        return Pixels(scene, scene.camera.evaluated_get(depsgraph))
    if view is None:
        raise GratingError(f"scene {scene.name}", "no camera", "add one and make it the scene's camera")
    return ViewPixels(view)
