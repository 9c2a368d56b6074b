# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh's UV maps: which one renders, and by what a map is known again."""

import hashlib

import bpy
import numpy as np

from ..gratings.direction_source import AXIS, COMB_TURN, COMB_UV, RADIAL, DirectionSource


def rendering_map(mesh: bpy.types.Mesh) -> bpy.types.MeshUVLoopLayer:
    """The UV map of a mesh, which has one, that materials read unless they name another."""
    return next((each for each in mesh.uv_layers if each.active_render), mesh.uv_layers[0])


def has_comb(mesh: bpy.types.Mesh) -> bool:
    """Whether Comb Grating has stored a direction on a mesh."""
    return COMB_UV in mesh.uv_layers and COMB_TURN in mesh.attributes


def has_uv_map(mesh: bpy.types.Mesh, source: DirectionSource) -> bool:
    """Whether a mesh has the UV map on which a source of the tangent rests; true if it rests on none."""
    if source.kind in (RADIAL, AXIS):
        return True
    return source.named_uv_map in mesh.uv_layers if source.named_uv_map else bool(mesh.uv_layers)


def fingerprint(mesh: bpy.types.Mesh, uv_map: str) -> str:
    """A text that is the same as long as the faces of a mesh, and what its UV map of a name holds, are the same. Moved
    vertices do not change it."""
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
