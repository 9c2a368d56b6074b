# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays through the pixels of a 3D view."""

import bpy
import numpy as np

from .camera_rays import Pixels

# The height of a 3D view's picture in pixels, where only its shape matters.
_HIGH = 1000


class ViewPixels(Pixels):
    """Converts the pixels of a 3D view to rays into the scene."""

    def __init__(self, view: bpy.types.RegionView3D) -> None:
        place, lens = np.array(view.view_matrix.inverted_safe()), np.array(view.window_matrix)
        is_flat = lens[3, 3] != 0
        self._kind = "ORTHO" if is_flat else "PERSP"
        self._axes = place[:3, :3]
        # A flat view also shows what lies behind the point around which it turns.
        behind = 10 * max(view.view_distance, 1.0) if is_flat else 0.0
        self._origin = place[:3, 3] + behind * self._axes[:, 2]
        shift = -lens[:2, 3] if is_flat else lens[:2, 2]
        scale = np.array([lens[0, 0], lens[1, 1]])
        self._corner = np.array([*(shift - 1) / scale, 0.0 if is_flat else -1.0])
        self._span = np.array([*2 / scale, 0.0])
        self.size = (max(1, round(_HIGH * scale[1] / scale[0])), _HIGH)
