# SPDX-License-Identifier: GPL-3.0-or-later
"""Lines that show a direction on a mesh: annotations, Grease Pencil, curves, hair and bones. Each line is an array of
segments (k, 2, 3) in world space, in drawing order, from root to tip, or from head to tail."""

from collections.abc import Iterable, Sequence
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix
from mathutils.geometry import interpolate_bezier

from ..blender import compat

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
