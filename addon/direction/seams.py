# SPDX-License-Identifier: GPL-3.0-or-later
"""UV seams where the direction of U changes from one face to the next, so that a grating's colours jump."""

import math
from typing import Any

import bpy
import numpy as np

from ..gratings.direction_source import STORED, UV_MAP, DirectionSource
from .uv_maps import has_comb, rendering_map

# Smaller turns of U shift the colours about as little as the curvature of the surface does.
_TURN_DEG = 15.0
# In UV units. Unwrapping gives both sides of an edge without a seam the same coordinates.
_SAME_UV = 1e-5


def seam_warning(mesh: bpy.types.Object, source: DirectionSource) -> str:
    """One warning line if U turns across the mesh's UV seams; else empty, also if the source does not follow U."""
    if source.kind not in (STORED, UV_MAP) or (source.kind == STORED and has_comb(mesh.data)):
        return ""
    seams = Seams(mesh.data, source.named_uv_map)
    if not seams.turned.any():
        return ""
    count = seams.island_count()
    where = f"{count} UV islands; the colours jump where they meet" if count > 1 else "U turns at its UV seams"
    return f"{mesh.name}: {where}; unwrap it with U along the body"


class Seams:
    """The edges between two faces of a mesh, and how its UV map crosses them: a named map, else the one that renders.

    edges   (n,) index of the edge
    faces   (n, 2) indices of its two faces
    joined  (n,) whether the UV map is continuous there
    turned  (n,) whether there is a seam and U turns on the surface by more than _TURN_DEG"""

    def __init__(self, mesh: bpy.types.Mesh, uv_map: str = "") -> None:
        corners = _Corners(mesh, mesh.uv_layers[uv_map] if uv_map else rendering_map(mesh))
        order = np.argsort(corners.edge, kind="stable")
        alike = corners.edge[order[:-1]] == corners.edge[order[1:]]
        one, other = order[:-1][alike], order[1:][alike]
        # Two faces of the same winding traverse their shared edge in opposite directions.
        opposite = corners.vertex[one] != corners.vertex[other]
        after, beyond = corners.following[one], corners.following[other]
        first, second = np.where(opposite, beyond, other), np.where(opposite, other, beyond)
        apart = np.abs(corners.uv[[one, after]] - corners.uv[[first, second]]).max(axis=(0, 2), initial=0)
        self.edges = corners.edge[one]
        self.faces = np.stack([corners.face[one], corners.face[other]], axis=1)
        self.joined = apart < _SAME_UV
        self.turned = np.zeros(len(one), bool)
        cut = np.flatnonzero(~self.joined)
        here, there = corners.direction_of_u(one[cut]), corners.direction_of_u(other[cut])
        # The same angle, measured from the other face's side of the edge.
        there = np.where(opposite[cut], there + math.pi, -there)
        self.turned[cut] = np.cos(here - there) < math.cos(math.radians(_TURN_DEG))
        self._face_count = len(mesh.polygons)

    def island_count(self) -> int:
        """The number of UV islands."""
        island = np.arange(self._face_count)
        pairs = self.faces[self.joined]
        while len(pairs):
            # Each island joins its neighbour with the lowest number; then every face looks up its new number.
            ends = np.sort(island[pairs], axis=1)
            apart = ends[:, 0] != ends[:, 1]
            pairs, ends = pairs[apart], ends[apart]
            np.minimum.at(island, ends[:, 1], ends[:, 0])
            while (island[island] != island).any():
                island = island[island]
        return len(np.unique(island))


class _Corners:
    """The corners (n,) of a mesh's faces: each with its vertex, its UV, and its edge to the next corner."""

    def __init__(self, mesh: bpy.types.Mesh, layer: bpy.types.MeshUVLoopLayer) -> None:
        start, count = (_read(mesh.polygons, name, np.int32) for name in ("loop_start", "loop_total"))
        self.edge, self.vertex = (_read(mesh.loops, name, np.int32) for name in ("edge_index", "vertex_index"))
        self.face = np.repeat(np.arange(len(start)), count)
        self.following = np.arange(1, len(self.face) + 1)
        self.following[start + count - 1] = start
        self.uv = _read(layer.uv, "vector", np.float32).reshape(-1, 2)
        self._points = _read(mesh.vertices, "co", np.float32).reshape(-1, 3)

    def direction_of_u(self, corners: np.ndarray) -> np.ndarray:
        """The angle (n,) from a corner's edge to the direction of U, in radians, positive towards the face's inside.

        Measured in the triangle of the edge and the corner after it. NaN where the triangle has no area in UV."""
        ends = self.following[corners]
        third = self.following[ends]
        begin, along, across = (self._points[self.vertex[at]] for at in (corners, ends, third))
        along, across = along - begin, across - begin
        length = np.linalg.norm(along, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            x = (along * across).sum(axis=1) / length
            y = np.sqrt(np.maximum((across * across).sum(axis=1) - x * x, 0))
            # The change of (u, v) per length along the edge, and orthogonal to it.
            per_x = (self.uv[ends] - self.uv[corners]) / length[:, None]
            per_y = (self.uv[third] - self.uv[corners] - per_x * x[:, None]) / y[:, None]
            sign = np.sign(per_x[:, 0] * per_y[:, 1] - per_x[:, 1] * per_y[:, 0])
            return np.where(sign == 0, np.nan, np.arctan2(-per_x[:, 1] * sign, per_y[:, 1] * sign))


def _read(items: "bpy.types.bpy_prop_collection[Any]", name: str, kind: type) -> np.ndarray:
    """A property of all items, as a flat array."""
    width = {"vector": 2, "co": 3}.get(name, 1)
    values: np.ndarray = np.empty(len(items) * width, kind)
    items.foreach_get(name, values)
    return values
