# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines on a mesh: those that give the scan's direction (annotations, Grease Pencil, curves, hair and bones), and those
that show it.

Each given line is an array of segments (k, 2, 3) in world space, in drawing order, from root to tip, or from head to
tail."""

from collections.abc import Iterable, Sequence
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix
from mathutils.geometry import interpolate_bezier

from ..blender import compat
from ..gratings.direction_source import STORED, UV_MAP, DirectionSource
from .seams import Seams
from .tangents import frame_field
from .uv_maps import has_comb, has_uv_map

_BEZIER_STEPS = 12


def strokes(scene: bpy.types.Scene, objects: Sequence[bpy.types.Object]) -> list[np.ndarray]:
    """The segments of each annotation stroke of the scene, and of the given Grease Pencil and curve objects."""
    drawn = [np.array([point.co for point in stroke.points]) for stroke in _annotated(scene)]
    for thing in objects:
        if thing.type == "GREASEPENCIL":
            drawn += [_placed(line, thing.matrix_world) for line in _pencilled(thing.data)]
        elif thing.type == "CURVE":
            drawn += [_placed(_along_spline(spline), thing.matrix_world) for spline in thing.data.splines]
    return _segments(drawn)


def hairs(mesh: bpy.types.Object, objects: Sequence[bpy.types.Object]) -> list[np.ndarray]:
    """The segments of each hair: of the given hair objects and of all hair that grows on the mesh."""
    growing = [o for o in bpy.data.objects if o.type == "CURVES" and (o in objects or o.data.surface == mesh)]
    found = []
    for thing in growing:
        positions = np.empty(len(thing.data.points) * 3, np.float32)
        thing.data.attributes["position"].data.foreach_get("vector", positions)
        ends = [hair.first_point_index for hair in thing.data.curves][1:]
        found += [_placed(line, thing.matrix_world) for line in np.split(positions.reshape(-1, 3), ends)]
    return _segments(found)


def bones(mesh: bpy.types.Object, objects: Sequence[bpy.types.Object]) -> list[np.ndarray]:
    """The segment of each deforming bone at rest. Uses the mesh's armature, else one among the given objects."""
    armature = mesh.find_armature() or next((o for o in objects if o.type == "ARMATURE"), None)
    if armature is None:
        return []
    lines = [np.array([bone.head_local, bone.tail_local]) for bone in armature.data.bones if bone.use_deform]
    return _segments([_placed(line, armature.matrix_world) for line in lines])


def _annotated(scene: bpy.types.Scene) -> Iterable[Any]:
    annotation: Any = compat.annotation_of(scene)
    for layer in annotation.layers if annotation is not None else ():
        frame = layer.active_frame or next(reversed(layer.frames), None)
        if frame is not None and not layer.annotation_hide:
            yield from (stroke for stroke in frame.strokes if stroke.display_mode == "3DSPACE")


def _pencilled(pencil: Any) -> Iterable[np.ndarray]:
    for layer in pencil.layers:
        frame = layer.current_frame()
        if frame is not None and not layer.hide:
            yield from (np.array([point.position for point in stroke.points]) for stroke in frame.drawing.strokes)


def _along_spline(spline: bpy.types.Spline) -> np.ndarray:
    """Points along a Bezier spline; the control points of any other spline."""
    if spline.type != "BEZIER":
        return np.array([point.co[:3] for point in spline.points])
    knots = list(spline.bezier_points)
    pieces = [
        interpolate_bezier(a.co, a.handle_right, b.handle_left, b.co, _BEZIER_STEPS)
        for a, b in zip(knots, knots[1:] + knots[:1] * spline.use_cyclic_u, strict=False)
    ]
    return np.array([point for piece in pieces for point in piece]).reshape(-1, 3)


def _placed(points: np.ndarray, world: Matrix) -> np.ndarray:
    """Points of an object, converted to world space."""
    matrix = np.array(world)
    return np.reshape(points, (-1, 3)) @ matrix[:3, :3].T + matrix[:3, 3]


def _segments(lines: Iterable[np.ndarray]) -> list[np.ndarray]:
    """The segments between the points of each line, without lines of zero length."""
    pairs = [np.stack([line[:-1], line[1:]], axis=1) for line in lines if len(line) > 1]
    return [pair for pair in pairs if np.ptp(pair.reshape(-1, 3), axis=0).any()]


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
