# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading a mesh for Comb Grating, and storing the resulting direction field on it."""

from typing import Any

import bpy
import numpy as np

from ...precompute.mesh.layout import Polygons
from ..gratings.direction_source import COMB_SINGULAR, COMB_TURN, COMB_UV


def polygons_of(mesh: bpy.types.Mesh) -> Polygons:
    """The faces of a mesh, without modifiers."""
    mesh.calc_loop_triangles()
    return Polygons(
        points=_values(mesh.vertices, "co", 3, np.float32).astype(float),
        point=_values(mesh.loops, "vertex_index", 1, np.int32)[:, 0],
        normals=_values(mesh.corner_normals, "vector", 3, np.float32).astype(float),
        corners=_values(mesh.loop_triangles, "loops", 3, np.int32),
        face=_values(mesh.loop_triangles, "polygon_index", 1, np.int32)[:, 0],
    )


def uv_of(layer: bpy.types.MeshUVLoopLayer) -> np.ndarray:
    """The UV coordinates (corners, 2) of a UV map."""
    return _values(layer.uv, "vector", 2, np.float32).astype(float)


def store(mesh: bpy.types.Mesh, uv: np.ndarray, turn: np.ndarray) -> None:
    """Store a field's UV map (corners, 2) and turns (corners, 3). The active and the rendering UV map stay the same."""
    layer = mesh.uv_layers.get(COMB_UV) or mesh.uv_layers.new(name=COMB_UV, do_init=False)
    layer.uv.foreach_set("vector", np.ascontiguousarray(uv, np.float32).ravel())
    old = mesh.attributes.get(COMB_TURN)
    if old is not None:
        mesh.attributes.remove(old)
    attribute = mesh.attributes.new(COMB_TURN, "FLOAT_VECTOR", "CORNER")
    attribute.data.foreach_set("vector", np.ascontiguousarray(turn, np.float32).ravel())
    mesh.update()


def note_singular(mesh: bpy.types.Mesh, triangles: np.ndarray) -> None:
    """Store the faces of singular triangles (s,) in an attribute for Show Direction, and select only their vertices."""
    mesh.calc_loop_triangles()
    chosen, singular = np.zeros(len(mesh.vertices), bool), np.zeros(len(mesh.polygons), bool)
    chosen[_values(mesh.loop_triangles, "vertices", 3, np.int32)[triangles]] = True
    singular[_values(mesh.loop_triangles, "polygon_index", 1, np.int32)[triangles, 0]] = True
    for items, selected in ((mesh.polygons, None), (mesh.edges, None), (mesh.vertices, chosen)):
        items.foreach_set("select", np.zeros(len(items), bool) if selected is None else selected)
    old = mesh.attributes.get(COMB_SINGULAR)
    if old is not None:
        mesh.attributes.remove(old)
    if singular.any():
        mesh.attributes.new(COMB_SINGULAR, "BOOLEAN", "FACE").data.foreach_set("value", singular)
    mesh.update()


def singular_faces(mesh: bpy.types.Mesh) -> np.ndarray:
    """The indices (k,) of the faces that Comb Grating stored as singular."""
    noted = mesh.attributes.get(COMB_SINGULAR)
    if noted is None or noted.domain != "FACE" or noted.data_type != "BOOLEAN":
        return np.empty(0, int)
    return np.flatnonzero(_values(noted.data, "value", 1, bool))


def _values(items: "bpy.types.bpy_prop_collection[Any]", name: str, width: int, kind: type) -> np.ndarray:
    """A property of all items, as an array (n, width)."""
    values: np.ndarray = np.empty(len(items) * width, kind)
    items.foreach_get(name, values)
    return values.reshape(-1, width)
