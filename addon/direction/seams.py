# SPDX-License-Identifier: GPL-3.0-or-later
"""Where a mesh's UV map changes direction from one face to the next, so that the colours of a grating jump."""

import math
from typing import Any

import bpy
import numpy as np

from ..gratings.direction_source import STORED, UV_MAP, DirectionSource
from .uv_maps import has_comb, rendering_map

# A turn of U by less moves the colours about as little as the bend of the surface itself does.
_TURN_DEG = 15.0
# Of the UV square. Unwrapping gives the two sides of an edge that is no seam the same numbers.
_SAME_UV = 1e-5


def seam_warning(mesh: bpy.types.Object, source: DirectionSource) -> str:
    """A line on the UV islands of a mesh, or nothing if U keeps its direction across all seams, or if the source of the
    tangent is no U of a UV map."""
    if source.kind not in (STORED, UV_MAP) or (source.kind == STORED and has_comb(mesh.data)):
        return ""
    seams = Seams(mesh.data, source.named_uv_map)
    if not seams.turned.any():
        return ""
    count = seams.island_count()
    where = f"{count} UV islands; the colours jump where they meet" if count > 1 else "U turns at its UV seams"
    return f"{mesh.name}: {where}; unwrap it with U along the body"


class Seams:
    """The edges of a mesh where two faces meet, by its UV map of a name, or by the one that renders.

    edges   (n,) the edge
    faces   (n, 2) its faces
    joined  (n,) whether the UV map goes on from the one to the other
    turned  (n,) whether it does not, and U turns along the surface by more than _TURN_DEG"""

    def __init__(self, mesh: bpy.types.Mesh, uv_map: str = "") -> None:
        corners = _Corners(mesh, mesh.uv_layers[uv_map] if uv_map else rendering_map(mesh))
        order = np.argsort(corners.edge, kind="stable")
        alike = corners.edge[order[:-1]] == corners.edge[order[1:]]
        one, other = order[:-1][alike], order[1:][alike]
        # Two faces of the same winding run along their edge opposite ways.
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
        # The same direction, told from the other face's side of the edge.
        there = np.where(opposite[cut], there + math.pi, -there)
        self.turned[cut] = np.cos(here - there) < math.cos(math.radians(_TURN_DEG))
        self._face_count = len(mesh.polygons)

    def island_count(self) -> int:
        """The number of pieces into which the UV map cuts the mesh."""
        island = np.arange(self._face_count)
        pairs = self.faces[self.joined]
        while len(pairs):
            # Each island joins its neighbour of the lowest number; then every face learns its island's new number.
            ends = np.sort(island[pairs], axis=1)
            apart = ends[:, 0] != ends[:, 1]
            pairs, ends = pairs[apart], ends[apart]
            np.minimum.at(island, ends[:, 1], ends[:, 0])
            while (island[island] != island).any():
                island = island[island]
        return len(np.unique(island))


class _Corners:
    """The corners of a mesh's faces (n,): each with its vertex, its edge to the corner that follows, and its UV."""

    def __init__(self, mesh: bpy.types.Mesh, layer: bpy.types.MeshUVLoopLayer) -> None:
        start, count = (_read(mesh.polygons, name, np.int32) for name in ("loop_start", "loop_total"))
        self.edge, self.vertex = (_read(mesh.loops, name, np.int32) for name in ("edge_index", "vertex_index"))
        self.face = np.repeat(np.arange(len(start)), count)
        self.following = np.arange(1, len(self.face) + 1)
        self.following[start + count - 1] = start
        self.uv = _read(layer.uv, "vector", np.float32).reshape(-1, 2)
        self._points = _read(mesh.vertices, "co", np.float32).reshape(-1, 3)

    def direction_of_u(self, corners: np.ndarray) -> np.ndarray:
        """The angle (n,) from a corner's edge to the direction of U along the face, towards the face's inside. It is
        that of the triangle of the edge and the corner after it. NaN where the triangle has no area."""
        ends = self.following[corners]
        third = self.following[ends]
        begin, along, across = (self._points[self.vertex[at]] for at in (corners, ends, third))
        along, across = along - begin, across - begin
        length = np.linalg.norm(along, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            x = (along * across).sum(axis=1) / length
            y = np.sqrt(np.maximum((across * across).sum(axis=1) - x * x, 0))
            # (u, v) per length along the edge, and at right angles to it.
            per_x = (self.uv[ends] - self.uv[corners]) / length[:, None]
            per_y = (self.uv[third] - self.uv[corners] - per_x * x[:, None]) / y[:, None]
            sign = np.sign(per_x[:, 0] * per_y[:, 1] - per_x[:, 1] * per_y[:, 0])
            return np.where(sign == 0, np.nan, np.arctan2(-per_x[:, 1] * sign, per_y[:, 1] * sign))


def _read(items: "bpy.types.bpy_prop_collection[Any]", name: str, kind: type) -> np.ndarray:
    """A property of all items, one after the other."""
    width = {"vector": 2, "co": 3}.get(name, 1)
    values: np.ndarray = np.empty(len(items) * width, kind)
    items.foreach_get(name, values)
    return values
