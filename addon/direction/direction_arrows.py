# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines that show the scan's direction on a mesh: arrows along T, UV seams where T turns, and rings around faces."""

import bpy
import numpy as np

from ..gratings.direction_source import STORED, UV_MAP, DirectionSource
from .seams import Seams
from .tangents_at_points import frame_field
from .uv_maps import has_comb, has_uv_map

# The length of an arrow, the length of its head, and its distance from the surface, in mean arrow spacings.
_LENGTH, _HEAD, _ABOVE = 0.7, 0.2, 0.05
# The radius of a ring in the same unit, and its number of line segments.
_RADIUS, _SIDES = 0.6, 12


def arrows(mesh: bpy.types.Mesh, triangles: np.ndarray, *, source: DirectionSource, angle: float) -> np.ndarray:
    """Arrows along T, turned by an angle in radians, at the centres of triangles (n,): the end points (k, 2, 3) of
    their lines in the mesh's space. Arrows are left out where the source has no direction."""
    if not len(triangles) or not has_uv_map(mesh, source):
        return np.empty((0, 2, 3))
    field = frame_field(mesh, triangles, shares=np.full((len(triangles), 3), 1 / 3), source=source)
    has = ~np.isnan(field.tangents).any(axis=1)
    points, n, t = (values[has] for values in (field.points, field.normals, field.tangents))
    b = np.cross(n, t)
    t, b = t * np.cos(angle) + b * np.sin(angle), b * np.cos(angle) - t * np.sin(angle)
    step = np.sqrt(_area(mesh) / max(1, len(triangles)))
    middle = points + n * (_ABOVE * step)
    tip, tail = middle + t * (_LENGTH / 2 * step), middle - t * (_LENGTH / 2 * step)
    barbs = [tip + (side * b - t) * (_HEAD * step) for side in (1, -1)]
    return np.concatenate([np.stack(pair, axis=1) for pair in ((tail, tip), (tip, barbs[0]), (tip, barbs[1]))])


def seam_lines(mesh: bpy.types.Mesh, source: DirectionSource) -> np.ndarray:
    """The edges (k, 2, 3), in the mesh's space, where U turns across a UV seam. Empty if the source does not use U."""
    combed = source.kind == STORED and has_comb(mesh)
    if source.kind not in (STORED, UV_MAP) or combed or not has_uv_map(mesh, source):
        return np.empty((0, 2, 3))
    seams = Seams(mesh, source.named_uv_map)
    ends = np.empty(2 * len(mesh.edges), np.int32)
    mesh.edges.foreach_get("vertices", ends)
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    return points.reshape(-1, 3)[ends.reshape(-1, 2)[seams.edges[seams.turned]]].astype(float)


def rings(mesh: bpy.types.Mesh, faces: np.ndarray, *, among: int) -> np.ndarray:
    """Rings around the centres of faces (k,): the ends (n, 2, 3) of their lines, in the mesh's space. `among`: number
    of arrows that set the scale."""
    step = np.sqrt(_area(mesh) / max(1, among))
    middles = np.array([mesh.polygons[face].center for face in faces]).reshape(-1, 3)
    normals = np.array([mesh.polygons[face].normal for face in faces]).reshape(-1, 3)
    # Some direction in the face: from the axis that is farthest from the normal.
    across = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
    across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
    turns = np.linspace(0, 2 * np.pi, _SIDES + 1)[:, None, None]
    round_it = across * np.cos(turns) + np.cross(normals, across) * np.sin(turns)
    points = middles + step * (normals * _RADIUS / 2 + round_it * _RADIUS)
    return np.stack([points[:-1], points[1:]], axis=2).reshape(-1, 2, 3)


def _area(mesh: bpy.types.Mesh) -> float:
    """The area of a mesh's faces."""
    areas = np.empty(len(mesh.polygons), np.float32)
    mesh.polygons.foreach_get("area", areas)
    return float(areas.sum(dtype=float))
