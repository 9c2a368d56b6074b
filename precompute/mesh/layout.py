# SPDX-License-Identifier: GPL-3.0-or-later
"""Stores a direction field so that Blender can carry it: a UV map whose every face is an island, and a turn per corner.

No modifier rotates a stored direction with the skin, but renderers compute a UV map's tangent on the deformed surface.
So each face gets UVs whose U follows the field's mean on the face. What remains is the small angle from this tangent to
the field at each corner. It is a scalar on the surface and survives deformation.
"""

from dataclasses import dataclass

import numpy as np

from .surface import Surface, unit

# An island fills this share of its cell. Subdivision would join islands that touch.
_FILL = 0.7


@dataclass(frozen=True)
class Polygons:
    """A mesh's faces and their triangulation.

    points    (n, 3) in metres
    point     (corners,) the point of each corner of the faces
    normals   (corners, 3) the shading normal there
    corners   (m, 3) the corners of each triangle
    face      (m,) the face of each triangle"""

    points: np.ndarray
    point: np.ndarray
    normals: np.ndarray
    corners: np.ndarray
    face: np.ndarray

    @property
    def triangles(self) -> np.ndarray:
        """The points (m, 3) of the triangles."""
        return self.point[self.corners]


def corner_directions(polygons: Polygons, surface: Surface, direction: np.ndarray) -> np.ndarray:
    """A field's directions (nodes,) at the corners of the faces: (corners, 3), of length 1, perpendicular to the
    shading normals. A corner without a triangle of some area takes the direction at its point, if known."""
    in_space = surface.to_space(direction)
    node_of_point = np.full(len(polygons.points), -1)
    node_of_point[surface.point_of_node] = np.arange(surface.node_count)
    node = node_of_point[polygons.point]
    node[polygons.corners[surface.kept].ravel()] = surface.node
    there = np.where(node[:, None] >= 0, in_space[node], [1.0, 0.0, 0.0])
    n = unit(polygons.normals)
    return _across(there, n)


def uv_directions(polygons: Polygons, uv: np.ndarray) -> np.ndarray:
    """The tangents (corners, 3) of a UV map (corners, 2) in renderers: averaged over faces that share a point and its
    UV."""
    places = np.column_stack([polygons.point, uv])
    _, weld = np.unique(places, axis=0, return_inverse=True)
    return _tangents(polygons, polygons.points[polygons.point], uv, weld=weld.ravel())


def lay(polygons: Polygons, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lay each face into a UV map with U along the field. Returns the UV map (corners, 2) and the turn (corners, 3) as
    cosine, sine and 0, in single precision. The directions (corners, 3) are perpendicular to the shading normals."""
    points, face = polygons.points[polygons.point], polygons.face
    faces = int(face.max(initial=-1)) + 1
    face_of_corner = np.zeros(len(points), np.int64)
    face_of_corner[polygons.corners] = face[:, None]
    normal = unit(_sums(face, _normals(points[polygons.corners]), faces))
    mean = _sums(face_of_corner, directions, faces)
    first = np.zeros(faces, np.int64)
    first[face_of_corner[::-1]] = np.arange(len(points))[::-1]
    # The mean may vanish on a face around which the field turns.
    mean = np.where(np.linalg.norm(mean, axis=1, keepdims=True) > 1e-6, mean, directions[first])
    u = _across(mean, normal)
    axes = np.stack([u, np.cross(normal, u)], axis=1)[face_of_corner]
    flat = np.einsum("ijk,ik->ij", axes, points)
    uv = _in_cells(flat, face_of_corner, faces).astype(np.float32)
    tangent = _tangents(polygons, points, uv.astype(float), weld=np.arange(len(points)))
    n = unit(polygons.normals)
    cosine = np.einsum("ij,ij->i", directions, tangent)
    sine = np.einsum("ij,ij->i", directions, np.cross(n, tangent))
    return uv, np.stack([cosine, sine, np.zeros(len(points))], axis=1).astype(np.float32)


def _in_cells(flat: np.ndarray, face: np.ndarray, faces: int) -> np.ndarray:
    """Place the corners (corners, 2) of each face in the face's own cell of the UV square. Each coordinate is stretched
    to fill the cell, which keeps the direction of U."""
    low, high = np.full((faces, 2), np.inf), np.full((faces, 2), -np.inf)
    np.minimum.at(low, face, flat)
    np.maximum.at(high, face, flat)
    size = np.where(high > low, high - low, 1)
    side = max(1, int(np.ceil(np.sqrt(faces))))
    cell = np.stack([np.arange(faces) % side, np.arange(faces) // side], axis=1)
    inside = (1 - _FILL) / 2 + _FILL * (flat - low[face]) / size[face]
    return (cell[face] + inside) / side


def _tangents(polygons: Polygons, points: np.ndarray, uv: np.ndarray, *, weld: np.ndarray) -> np.ndarray:
    """The tangents (corners, 3) of a UV map as renderers compute them: each triangle's tangent, projected perpendicular
    to the corner's normal, averaged over triangles by their angles (Mikkelsen, "Simulation of wrinkled surfaces
    revisited", 2008, section 3.4). Corners with the same number in `weld` (corners,) are one place."""
    at, on = points[polygons.corners], uv[polygons.corners]
    one, two = at[:, 1] - at[:, 0], at[:, 2] - at[:, 0]
    by_one, by_two = on[:, 1] - on[:, 0], on[:, 2] - on[:, 0]
    along = one * by_two[:, 1:] - two * by_one[:, 1:]
    turned = np.sign(by_one[:, 0] * by_two[:, 1] - by_one[:, 1] * by_two[:, 0])
    along = np.repeat(along * turned[:, None], 3, axis=0)
    corner = polygons.corners.ravel()
    n = unit(polygons.normals)
    after, before = np.roll(at, -1, axis=1) - at, np.roll(at, 1, axis=1) - at
    angle = np.arccos(np.clip(np.einsum("ijk,ijk->ij", _units(after), _units(before)), -1, 1)).ravel()
    found = _sums(weld[corner], _across(along, n[corner]) * angle[:, None], int(weld.max(initial=-1)) + 1)
    return _across(found[weld], n)


def _across(vectors: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Project vectors perpendicular to the normals, at length 1; any perpendicular if nothing is left."""
    left = vectors - normals * np.einsum("ij,ij->i", vectors, normals)[:, None]
    nothing = np.linalg.norm(left, axis=1) < 1e-9
    left[nothing] = np.cross(normals[nothing], np.eye(3)[np.abs(normals[nothing]).argmin(axis=1)])
    return unit(left)


def _units(vectors: np.ndarray) -> np.ndarray:
    return unit(vectors.reshape(-1, 3)).reshape(vectors.shape)


def _normals(corners: np.ndarray) -> np.ndarray:
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _sums(index: np.ndarray, vectors: np.ndarray, count: int) -> np.ndarray:
    """Sum vectors by their index: (count, 3)."""
    return np.stack([np.bincount(index, vectors[:, axis], count) for axis in range(3)], axis=1)
