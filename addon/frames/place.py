# SPDX-License-Identifier: GPL-3.0-or-later
"""The frame of the scan at one place of a mesh, as the nodes of frame.py have it in every pixel."""

from dataclasses import dataclass
from math import cos, sin

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ...precompute.base.failure import GratingError


@dataclass(frozen=True)
class Place:
    """A place on a surface, in the scene's space.

    position  of the point, m
    normal    shading normal there, unit
    tangent   the direction of the UV map's U, unit, across the normal
    slot      the number of its face's material slot"""

    position: Vector
    normal: Vector
    tangent: Vector
    slot: int

    def lamp_matrix(self, *, rotation: float, height: float) -> Matrix:
        """The world matrix of a lamp that stands `height` above the place and shines along the normal. Its X axis is
        the direction of the scan's columns: the tangent, turned by `rotation` radians towards B = N x T."""
        across = self.normal.cross(self.tangent)
        columns = self.tangent * cos(rotation) + across * sin(rotation)
        matrix = Matrix((columns, columns.cross(self.normal), -self.normal)).transposed().to_4x4()
        matrix.translation = self.position + self.normal * height
        return matrix


def place_nearest(mesh: bpy.types.Object, depsgraph: bpy.types.Depsgraph, *, to: Vector) -> Place:
    """The place of a mesh, modifiers included, that is nearest to a point of the scene.

    Raises GratingError if the mesh has no face, or no UV map of some area there."""
    evaluated = mesh.evaluated_get(depsgraph)
    data, world = evaluated.data, evaluated.matrix_world
    if not data.polygons or not data.uv_layers:
        raise GratingError(f"{mesh.name}: no faces with a UV map, so no direction for the grating; unwrap it")
    _, point, _, face = evaluated.closest_point_on_mesh(world.inverted_safe() @ to)
    data.calc_loop_triangles()
    triangles = [_Triangle(data, each) for each in data.loop_triangles if each.polygon_index == face]
    at = max(triangles, key=lambda triangle: triangle.shares(point).min())
    normal = (world.to_3x3().inverted_safe().transposed() @ at.normal(point)).normalized()
    along = world.to_3x3() @ at.along_u(mesh.name)
    tangent = (along - normal * along.dot(normal)).normalized()
    return Place(world @ point, normal, tangent, data.polygons[face].material_index)


class _Triangle:
    """A triangle of a mesh: its points (3, 3), their shading normals (3, 3) and UV (3, 2)."""

    def __init__(self, data: bpy.types.Mesh, triangle: bpy.types.MeshLoopTriangle) -> None:
        layer = next((each for each in data.uv_layers if each.active_render), data.uv_layers[0])
        self._points = np.array([data.vertices[index].co for index in triangle.vertices])
        self._normals = np.array([data.corner_normals[loop].vector for loop in triangle.loops])
        self._uv = np.array([layer.uv[loop].vector for loop in triangle.loops])

    def shares(self, point: Vector) -> np.ndarray:
        """The shares (3,) of the corners in a point of the triangle's plane; one is negative for a point outside."""
        first, *edges = self._points
        along = np.linalg.lstsq(np.transpose(edges - first), np.array(point) - first, rcond=None)[0]
        return np.array([1 - along.sum(), *along])

    def normal(self, point: Vector) -> Vector:
        """The shading normal at a point."""
        return Vector(self.shares(point) @ self._normals)

    def along_u(self, name: str) -> Vector:
        """The step in space for a step of U. Raises GratingError, naming the object, if the triangle has no area in
        the UV map."""
        by_uv = self._uv[1:] - self._uv[0]
        if abs(np.linalg.det(by_uv)) < 1e-12:
            raise GratingError(f"{name}: its UV map has no area there, so no direction for the grating; unwrap it")
        return Vector(np.linalg.solve(by_uv, self._points[1:] - self._points[0])[0])
