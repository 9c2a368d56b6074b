# SPDX-License-Identifier: GPL-3.0-or-later
"""The scan's direction at points of a mesh, in NumPy. Mirrors the nodes of tangent_frame.py, but takes the direction of
U per flat triangle, where renderers smooth it over neighbouring triangles."""

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ..gratings.direction_source import AXIS, COMB_TURN, COMB_UV, FRAME_MAP, RADIAL, STORED, DirectionSource
from .uv_maps import has_comb, rendering_map


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
