# SPDX-License-Identifier: GPL-3.0-or-later
"""The scan's direction at points of a mesh, in NumPy, also at the one nearest to a place. Mirrors the nodes of
tangent_frame.py, but takes the direction of U per flat triangle, where renderers smooth it over neighbouring
triangles."""

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, isnan, nan, sin
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ...precompute.base.failure import GratingError
from ..blender import stored
from ..gratings.direction_source import (
    AXIS,
    COMB_TURN,
    COMB_UV,
    DIRECTION_REMEDY,
    FRAME_MAP,
    RADIAL,
    STORED,
    DirectionSource,
)
from .uv_maps import has_comb, has_uv_map, rendering_map


@dataclass(frozen=True)
class Field:
    """Points (n, 3) of a mesh in its own space, their unit normals (n, 3) and unit tangents (n, 3). A tangent is NaN
    where its source has no direction, for example where the UV map has no area."""

    points: np.ndarray
    normals: np.ndarray
    tangents: np.ndarray


def frame_field(mesh: bpy.types.Mesh, triangles: np.ndarray, *, shares: np.ndarray, source: DirectionSource) -> Field:
    """The normals and tangents at points of loop triangles, given by indices (n,) and barycentric coordinates `shares`
    (n, 3). Rotation is not applied. The mesh must have the UV map that the source names."""
    corners = _numbers(mesh.loop_triangles, "loops", 3)[triangles]
    vertices = _numbers(mesh.loops, "vertex_index", 1)[corners, 0]
    ends = _values(mesh.vertices, "co", 3)[vertices]
    points = np.einsum("nc,ncx->nx", shares, ends)
    normals = _unit(np.einsum("nc,ncx->nx", shares, _values(mesh.corner_normals, "vector", 3)[corners]))
    if source.kind == AXIS:
        tangents = np.broadcast_to(source.axis_vector, points.shape)
    elif source.kind == RADIAL:
        tangents = points * (1.0 - np.array(source.axis_vector))
    elif source.kind == STORED and has_comb(mesh):
        tangents = np.einsum("nc,ncx->nx", shares, _combed(mesh, corners, ends))
    else:
        layer = mesh.uv_layers[source.named_uv_map] if source.named_uv_map else rendering_map(mesh)
        uv = _values(layer.uv, "vector", 2)[corners]
        tangents = _across(normals, _along_u(ends, uv))
        if source.kind == FRAME_MAP and source.frame_map is not None:
            cosine_sine = _read_map(source.frame_map, np.einsum("nc,ncx->nx", shares, uv))
            tangents = cosine_sine[:, :1] * tangents + cosine_sine[:, 1:] * np.cross(normals, tangents)
    return Field(points, normals, _across(normals, tangents))


def _combed(mesh: bpy.types.Mesh, corners: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """The tangents (n, 3, 3) that Comb Grating stored at corners (n, 3) with positions `ends` (n, 3, 3)."""
    along = _along_u(ends, _values(mesh.uv_layers[COMB_UV].uv, "vector", 2)[corners])
    normals = _values(mesh.corner_normals, "vector", 3)[corners].reshape(-1, 3)
    turn = _values(mesh.attributes[COMB_TURN].data, "vector", 3)[corners].reshape(-1, 3)
    tangents = _across(normals, np.repeat(along, 3, axis=0))
    return (turn[:, :1] * tangents + turn[:, 1:2] * np.cross(normals, tangents)).reshape(-1, 3, 3)


def _along_u(ends: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """The direction (n, 3) of U in triangles with points (n, 3, 3) and UV (n, 3, 2). NaN where the UV has no area."""
    edges, steps = ends[:, 1:] - ends[:, :1], uv[:, 1:] - uv[:, :1]
    area = steps[:, 0, 0] * steps[:, 1, 1] - steps[:, 0, 1] * steps[:, 1, 0]
    # dP = P_u du + P_v dv along both edges, solved for P_u.
    along = steps[:, 1, 1, None] * edges[:, 0] - steps[:, 0, 1, None] * edges[:, 1]
    return np.where(np.abs(area) > 1e-12, np.sign(area), np.nan)[:, None] * along


def _read_map(image: bpy.types.Image, uv: np.ndarray) -> np.ndarray:
    """The cosine and sine (n, 2) in a direction map's pixels nearest to UV (n, 2)."""
    width, height = image.size
    pixels = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    columns = np.clip((uv[:, 0] * width).astype(int), 0, width - 1)
    rows = np.clip((uv[:, 1] * height).astype(int), 0, height - 1)
    return 2 * pixels.reshape(height, width, -1)[rows, columns, :2].astype(float) - 1


def _across(normals: np.ndarray, tangents: np.ndarray) -> np.ndarray:
    """The parts of tangents that are orthogonal to unit normals, normalised."""
    return _unit(tangents - normals * (normals * tangents).sum(axis=1, keepdims=True))


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.divide(vectors, length, out=np.full(vectors.shape, np.nan), where=length > 0)


def _values(items: "bpy.types.bpy_prop_collection[Any]", name: str, width: int) -> np.ndarray:
    """A vector property of all items, as an array (n, width)."""
    values = np.empty(len(items) * width, np.float32)
    items.foreach_get(name, values)
    return values.reshape(-1, width).astype(float)


def _numbers(items: "bpy.types.bpy_prop_collection[Any]", name: str, width: int) -> np.ndarray:
    """An integer property of all items, as an array (n, width)."""
    values = np.empty(len(items) * width, np.int32)
    items.foreach_get(name, values)
    return values.reshape(-1, width)


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
