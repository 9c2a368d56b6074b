# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh's UV maps: which one renders, and a fingerprint that detects changes."""

import hashlib

import bpy
import numpy as np

from ..gratings.direction_source import AXIS, COMB_TURN, COMB_UV, RADIAL, DirectionSource


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
