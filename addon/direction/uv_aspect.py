# SPDX-License-Identifier: GPL-3.0-or-later
"""The shape on the surface of the square from 0 to 1 of a UV map."""

import bpy
import numpy as np

from .uv_maps import rendering_map

# Beyond these, a map counts as degenerate.
_LEAST, _MOST = 1e-3, 1e3


def uv_aspect(thing: bpy.types.Object, uv_map: str = "") -> float:
    """The height of the UV square over its width, in world space, as a mean over the map. 1 for a degenerate map.

    An empty `uv_map` stands for the map that renders. The mesh must have the map and must not be in Edit Mode."""
    mesh = thing.data
    mesh.calc_loop_triangles()
    uv_layer = mesh.uv_layers[uv_map] if uv_map else rendering_map(mesh)
    loops = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    corners, places, uv = (
        np.empty(size, kind)
        for size, kind in (
            (len(mesh.loops), np.int32), (3 * len(mesh.vertices), np.float32), (2 * len(mesh.loops), np.float32)
        )
    )  # fmt: skip
    mesh.loops.foreach_get("vertex_index", corners)
    mesh.vertices.foreach_get("co", places)
    uv_layer.uv.foreach_get("vector", uv)
    matrix = np.array(thing.matrix_world)[:3, :3]
    p = (places.reshape(-1, 3) @ matrix.T)[corners[loops]].reshape(-1, 3, 3)
    q = uv.reshape(-1, 2)[loops].reshape(-1, 3, 2)
    e, f = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    d, g = q[:, 1] - q[:, 0], q[:, 2] - q[:, 0]
    # Along U the place changes by (e g_v - f d_v) / det, along V by (f d_u - e g_u) / det. Weighted by the triangle's
    # area on the map, which is det / 2, the means need no division.
    along_u, along_v = e * g[:, 1:] - f * d[:, 1:], f * d[:, :1] - e * g[:, :1]
    width, height = (float(np.linalg.norm(each, axis=1).sum()) for each in (along_u, along_v))
    aspect = height / width if width > 0 else 1.0
    return aspect if _LEAST <= aspect <= _MOST else 1.0
