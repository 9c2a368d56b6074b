# SPDX-License-Identifier: GPL-3.0-or-later
"""The scan's direction at one point of a mesh, as the nodes of tangent_frame.py give it."""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, isnan, nan, sin
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ...precompute.base.failure import GratingError
from ..blender import stored
from ..gratings.direction_source import DIRECTION_REMEDY, DirectionSource
from .tangents_at_points import frame_field
from .uv_maps import has_uv_map


@dataclass(frozen=True)
class Place:
    """A point on a surface, in world space.

    position  of the point, m
    normal    unit shading normal
    tangent   unit tangent T without Rotation, orthogonal to the normal
    slot      index of its face's material slot"""

    position: Vector
    normal: Vector
    tangent: Vector
    slot: int

    def lamp_matrix(self, *, rotation: float, height: float) -> Matrix:
        """The world matrix of a lamp `height` above the point that shines along the normal. Its X axis is the scan's x
        axis: the tangent, turned by `rotation` radians towards B = N x T."""
        across = self.normal.cross(self.tangent)
        columns: Any = self.tangent * cos(rotation) + across * sin(rotation)  # type: ignore[operator]  # vectors
        axes = (columns, columns.cross(self.normal), -self.normal)
        matrix = Matrix([tuple(axis) for axis in axes]).transposed().to_4x4()
        matrix.translation = self.position + self.normal * height
        return matrix


def own_angle(thing: bpy.types.Object, source: DirectionSource) -> float:
    """An object's own angle in radians, added to Rotation: its custom property, else its data's, else 0."""
    held = (stored.number(owner, source.angle, nan) for owner in (thing, thing.data))
    return next((float(value) for value in held if not isnan(value)), 0.0) if source.angle else 0.0


def place_nearest(
    mesh: bpy.types.Object, depsgraph: bpy.types.Depsgraph, *, to: Vector, source_at: Callable[[int], DirectionSource]
) -> Place:
    """The point of a mesh, with modifiers, nearest to a point in world space. `source_at` returns the source of the
    tangent for a material slot.

    Raises GratingError if the mesh has no faces, or if the source has no direction there."""
    evaluated = mesh.evaluated_get(depsgraph)
    data, world = evaluated.data, evaluated.matrix_world
    if not data.polygons:
        raise GratingError(mesh.name, "no faces, so no place for a lamp", "choose a mesh with faces")
    _, point, _, face = evaluated.closest_point_on_mesh(world.inverted_safe() @ to)
    slot = data.polygons[face].material_index
    source = source_at(slot)
    if not has_uv_map(data, source):
        raise GratingError(mesh.name, "no UV map, so no direction for the grating", DIRECTION_REMEDY)
    data.calc_loop_triangles()
    shares = {
        number: _shares([data.vertices[index].co for index in triangle.vertices], point)
        for number, triangle in enumerate(data.loop_triangles)
        if triangle.polygon_index == face
    }
    number = max(shares, key=lambda each: shares[each].min())
    field = frame_field(data, np.array([number]), shares=shares[number][None], source=source)
    if np.isnan(field.tangents).any():
        raise GratingError(mesh.name, "its UV map has no area there, so no direction for the grating", "unwrap it")
    normal = (world.to_3x3().inverted_safe().transposed() @ Vector(field.normals[0])).normalized()
    along = world.to_3x3() @ Vector(field.tangents[0])
    return Place(world @ point, normal, (along - normal * along.dot(normal)).normalized(), slot)


def _shares(corners: list[Vector], point: Vector) -> np.ndarray:
    """The barycentric coordinates (3,) of a point in a triangle's plane. One is negative if the point is outside."""
    first, *edges = np.array(corners)
    along = np.linalg.lstsq(np.transpose(edges - first), np.array(point) - first, rcond=None)[0]
    return np.array([1 - along.sum(), *along])
