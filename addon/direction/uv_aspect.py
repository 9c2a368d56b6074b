# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape on the surface of the square from 0 to 1 of a UV map."""

import bpy
import numpy as np

from .combed_mesh import polygons_of, uv_of
from .uv_maps import rendering_map

# Beyond these, a map counts as degenerate.
_LEAST, _MOST = 1e-3, 1e3


def uv_aspect(thing: bpy.types.Object, uv_map: str = "") -> float:
    """The height of the UV square over its width, in world space, as a mean over the map. 1 for a degenerate map.

    An empty `uv_map` stands for the map that renders. The mesh must have the map and must not be in Edit Mode."""
    faces, maps = polygons_of(thing.data), thing.data.uv_layers
    uv = uv_of(maps[uv_map] if uv_map else rendering_map(thing.data))
    places = faces.points @ np.array(thing.matrix_world)[:3, :3].T
    p, q = places[faces.triangles], uv[faces.corners]
    e, f = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    d, g = q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]
    # Along U the place changes by (e g_v - f d_v) / det, along V by (f d_u - e g_u) / det. Weighted by the triangle's
    # area on the map, which is det / 2, the means need no division.
    along_u, along_v = e * g[:, 1:] - f * d[:, 1:], f * d[:, :1] - e * g[:, :1]
    width, height = (float(np.linalg.norm(each, axis=1).sum()) for each in (along_u, along_v))
    aspect = height / width if width > 0 else 1.0
    return aspect if _LEAST <= aspect <= _MOST else 1.0
