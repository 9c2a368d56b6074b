# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays through the pixels of a 3D view."""

import bpy
import numpy as np

from .camera_rays import Pixels

# The rays of an orthographic view begin this far behind its middle, in metres: the view shows what is behind it too.
_BEHIND = 1e3


class ViewPixels(Pixels):
    """Converts the pixels of a 3D view to rays into the scene."""

    def __init__(self, view: bpy.types.RegionView3D, size: tuple[int, int]) -> None:
        place = np.array(view.view_matrix.inverted())
        self._axes, self._origin = place[:3, :3], place[:3, 3]
        self._kind = "PERSP" if view.is_perspective else "ORTHO"
        if not view.is_perspective:
            self._origin = self._origin + _BEHIND * self._axes[:, 2]
        # The frame at a depth of 1, from the projection that maps it to -1 to 1.
        projection = np.array(view.window_matrix)
        shift = projection[:2, 2] if view.is_perspective else -projection[:2, 3]
        low, high = ((end + shift) / (projection[0, 0], projection[1, 1]) for end in (-1.0, 1.0))
        self._corner, self._span = np.array([*low, -1.0]), np.array([*(high - low), 0.0])
        self.size = size
