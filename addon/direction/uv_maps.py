# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh's UV maps: which one renders, its shape on the surface, and a fingerprint that detects changes."""

import hashlib

import bpy
import numpy as np

from ..gratings.direction_source import AXIS, COMB_TURN, COMB_UV, RADIAL, DirectionSource
from .combed_mesh import polygons_of, uv_of

# Beyond these, a map counts as degenerate.
_LEAST, _MOST = 1e-3, 1e3


def rendering_map(mesh: bpy.types.Mesh) -> bpy.types.MeshUVLoopLayer:
    """The UV map that renders: materials read it unless they name another. The mesh must have a UV map."""
    return next((each for each in mesh.uv_layers if each.active_render), mesh.uv_layers[0])


def has_comb(mesh: bpy.types.Mesh) -> bool:
    """Whether Comb Grating has stored a direction on a mesh."""
    return COMB_UV in mesh.uv_layers and COMB_TURN in mesh.attributes


def has_uv_map(mesh: bpy.types.Mesh, source: DirectionSource) -> bool:
    """Whether a mesh has the UV map that a source needs; true if the source needs none."""
    if source.kind in (RADIAL, AXIS):
        return True
    return source.named_uv_map in mesh.uv_layers if source.named_uv_map else bool(mesh.uv_layers)


def fingerprint(mesh: bpy.types.Mesh, uv_map: str) -> str:
    """A hash of a mesh's faces and of the coordinates of one UV map. Moving vertices does not change it."""
    told = hashlib.sha256()
    for items, name, kind, width in (
        (mesh.loops, "vertex_index", np.int32, 1),
        (mesh.polygons, "loop_total", np.int32, 1),
        (mesh.uv_layers[uv_map].uv, "vector", np.float32, 2),
    ):
        values = np.empty(len(items) * width, kind)
        items.foreach_get(name, values)
        told.update(values.tobytes())
    return told.hexdigest()[:16]


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
