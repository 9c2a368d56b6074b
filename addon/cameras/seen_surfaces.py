# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the camera's rays meet meshes that show gratings, and the grating's tangent frame there."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from functools import cached_property
from math import cos, sin
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ..direction.surface_point import own_angle
from ..direction.tangents_at_points import frame_field
from ..direction.uv_maps import has_uv_map
from ..materials.group_properties import frame_of
from ..materials.material import diffraction_nodes, number_in

# Limits for rays through hidden objects: how many objects, and the step behind each, relative to the distance.
_THROUGH, _BEHIND = 8, 1e-5


@dataclass(frozen=True)
class Places:
    """n points of one object that a camera sees, in world space.

    rays     (n,), the indices of the rays that hit them
    to_view  (n, 3), unit vectors to the camera
    frames   (n, 3, 3), the tangent frames: unit vectors T, B, N, turned by Rotation and the object's own angle"""

    thing: bpy.types.Object
    node: bpy.types.Node
    rays: np.ndarray
    points: np.ndarray
    to_view: np.ndarray
    frames: np.ndarray


@dataclass
class _Hits:
    """Ray hits on one object, instance and material slot: indices of the rays and of the faces, and the points."""

    thing: bpy.types.Object
    matrix: Matrix
    node: bpy.types.Node
    rays: list[int]
    faces: list[int]
    points: list[Vector]


def seen_by(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, rays: tuple[np.ndarray, np.ndarray]
) -> list[Places]:
    """The nearest surfaces with a grating along rays, given as origins and unit directions (n, 3). Rays pass through
    objects that are hidden from the camera in renders. Meshes in Edit Mode are left out."""
    origins, directions = rays
    foreign = _own_instances(depsgraph)
    meshes: dict[bpy.types.Object, _Mesh] = {}
    found: dict[tuple[Any, ...], _Hits] = {}
    for number, (origin, direction) in enumerate(zip(origins.tolist(), directions.tolist(), strict=True)):
        hit, point, face, thing, matrix = _first(scene, depsgraph, Vector(origin), Vector(direction))
        if not hit or thing is None or thing.type != "MESH" or (thing, tuple(map(tuple, matrix))) in foreign:
            continue
        if thing.original.data.is_editmode:  # its faces cannot be read
            continue
        if thing not in meshes:
            meshes[thing] = _Mesh(thing, depsgraph)
        mesh = meshes[thing]
        slot = mesh.slot_of(face)
        node = mesh.nodes[slot]
        if node is None:
            continue
        key = (thing, tuple(map(tuple, matrix)), slot)
        if key not in found:
            found[key] = _Hits(thing, matrix.copy(), node, [], [], [])
        hits = found[key]
        hits.rays.append(number)
        hits.faces.append(face)
        hits.points.append(point)
    return [_placed(hits, meshes[hits.thing], directions) for hits in found.values()]


def rays_that_hit(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, rays: tuple[np.ndarray, np.ndarray], *,
    things: Collection[bpy.types.Object],
) -> np.ndarray:  # fmt: skip
    """The indices of the rays whose nearest surface belongs to one of these objects, as seen_by finds it."""
    pairs = zip(*(each.tolist() for each in rays), strict=True)
    nearest = [_first(scene, depsgraph, Vector(origin), Vector(direction))[3] for origin, direction in pairs]
    return np.array([k for k, thing in enumerate(nearest) if thing is not None and thing.original in things], int)


def _own_instances(depsgraph: bpy.types.Depsgraph) -> set[tuple[bpy.types.Object, tuple[Any, ...]]]:
    """Instances that Geometry Nodes make of another object's mesh, as pairs of object and matrix. The ray cast reports
    a hit on one with the object, but with the other mesh's face index, so the face cannot be found. Instances at the
    object's own matrix are left out: they look like the object, as do its curves and points, which rays do not hit."""
    return {
        (instance.object.original, tuple(map(tuple, instance.matrix_world)))
        for instance in depsgraph.object_instances
        if instance.is_instance
        and instance.parent is not None
        and instance.object.original == instance.parent.original
        and instance.matrix_world != instance.parent.matrix_world
    }


def boxes_with_gratings(
    depsgraph: bpy.types.Depsgraph, among: Collection[bpy.types.Object] | None = None
) -> Iterator[tuple[np.ndarray, Matrix]]:
    """The bounding boxes of the scene's meshes and instances that show a grating: corners (8, 3) and matrices. `among`
    leaves out other objects."""
    for instance in depsgraph.object_instances:
        thing = instance.object
        if among is not None and thing.original not in among:
            continue
        if thing.type == "MESH" and any(diffraction_nodes(slot.material) for slot in thing.original.material_slots):
            yield np.array([corner[:] for corner in thing.bound_box]), instance.matrix_world.copy()


class _Mesh:
    """The evaluated mesh of an object. Its arrays are read when they are first used."""

    def __init__(self, thing: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> None:
        self.thing, self._evaluated = thing, thing.evaluated_get(depsgraph)
        nodes = [diffraction_nodes(slot.material) for slot in thing.material_slots]
        # As in Blender, a face with a slot index that is too high shows the last slot.
        self.nodes = [each[0] if each and self._can_show(each[0]) else None for each in nodes] or [None]

    def slot_of(self, face: int) -> int:
        """The material slot of a face; -1, the last slot, if the object has at most one."""
        return min(int(self._slots[face]), len(self.nodes) - 1) if len(self.nodes) > 1 else -1

    @property
    def data(self) -> bpy.types.Mesh:
        """The mesh with its modifiers."""
        return self._evaluated.data

    @cached_property
    def _slots(self) -> np.ndarray:
        return _numbers(self.data.polygons, "material_index")

    @cached_property
    def first_triangles(self) -> np.ndarray:
        """(faces + 1,): the index of each face's first triangle, then the number of triangles."""
        self.data.calc_loop_triangles()
        return np.searchsorted(
            _numbers(self.data.loop_triangles, "polygon_index"), np.arange(len(self.data.polygons) + 1)
        )

    def _can_show(self, node: bpy.types.Node) -> bool:
        return has_uv_map(self.data, frame_of(node.node_tree))


def _first(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, origin: Vector, direction: Vector
) -> tuple[bool, Vector, int, bpy.types.Object | None, Matrix]:
    """A ray's first hit on an object that is visible in renders: whether there is one, point, face, object and
    matrix."""
    for _ in range(_THROUGH):
        hit, point, _, face, thing, matrix = scene.ray_cast(depsgraph, origin, direction)
        if not hit or not (thing.hide_render or not thing.visible_camera):
            return hit, point, face, thing, matrix
        origin = point + direction * (_BEHIND * max((point - origin).length, 1e-3))
    return False, point, face, thing, matrix


def _placed(hits: _Hits, mesh: _Mesh, directions: np.ndarray) -> Places:
    """The places of hits with their tangent frames. Hits where the source gives no direction are dropped."""
    source = frame_of(hits.node.node_tree)
    world = np.array(hits.matrix)
    points, rays = np.array(hits.points), np.array(hits.rays)
    own = (points - world[:3, 3]) @ np.linalg.inv(world[:3, :3]).T
    triangles, shares = _triangles_at(mesh, np.array(hits.faces), own)
    field = frame_field(mesh.data, triangles, shares=shares, source=source)
    normals = _unit(field.normals @ np.linalg.inv(world[:3, :3]))
    flat = _unit(_face_normals(mesh.data, triangles) @ np.linalg.inv(world[:3, :3]))
    # As in renderers, the normal faces the side that is seen.
    normals *= np.where((flat * directions[rays]).sum(axis=1, keepdims=True) > 0, -1.0, 1.0)
    along = field.tangents @ world[:3, :3].T
    along = _unit(along - normals * (along * normals).sum(axis=1, keepdims=True))
    across = np.cross(normals, along)
    turn = number_in(hits.node, "Rotation") + own_angle(hits.thing, source)
    tangents = along * cos(turn) + across * sin(turn)
    frames = np.stack([tangents, np.cross(normals, tangents), normals], axis=1)
    known = np.isfinite(frames).all(axis=(1, 2))
    return Places(hits.thing, hits.node, rays[known], points[known], -directions[rays[known]], frames[known])


def _triangles_at(mesh: _Mesh, faces: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The triangles (n,) that contain points (n, 3) in object space on faces (n,), and the points' barycentric
    coordinates (n, 3), none of them negative."""
    first = mesh.first_triangles
    triangles, shares = first[faces], np.full((len(faces), 3), -np.inf)
    corners = _numbers(mesh.data.loop_triangles, "vertices", 3)
    places = _numbers(mesh.data.vertices, "co", 3, np.float32).astype(float)
    for k in range(int((first[faces + 1] - first[faces]).max(initial=0))):
        number = np.minimum(first[faces] + k, first[faces + 1] - 1)
        found = _shares(places[corners[number]], points)
        better = found.min(axis=1) > shares.min(axis=1)
        triangles, shares = np.where(better, number, triangles), np.where(better[:, None], found, shares)
    shares = np.maximum(np.nan_to_num(shares, neginf=0.0), 0)
    total = shares.sum(axis=1, keepdims=True)
    return triangles, np.where(total > 0, shares / np.maximum(total, 1e-30), 1 / 3)


def _shares(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """The barycentric coordinates (n, 3) of points (n, 3) in triangles (n, 3, 3); NaN for a triangle without area."""
    a, b, p = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], points - corners[:, 0]
    aa, ab, bb = (a * a).sum(axis=1), (a * b).sum(axis=1), (b * b).sum(axis=1)
    pa, pb, area = (p * a).sum(axis=1), (p * b).sum(axis=1), aa * bb - ab * ab
    with np.errstate(invalid="ignore", divide="ignore"):
        second, third = (bb * pa - ab * pb) / area, (aa * pb - ab * pa) / area
    return np.stack([1 - second - third, second, third], axis=1)


def _face_normals(mesh: bpy.types.Mesh, triangles: np.ndarray) -> np.ndarray:
    """The normals (n, 3) of triangles, not of unit length."""
    corners = _numbers(mesh.vertices, "co", 3, np.float32).astype(float)[
        _numbers(mesh.loop_triangles, "vertices", 3)[triangles]
    ]
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _unit(vectors: np.ndarray) -> np.ndarray:
    with np.errstate(invalid="ignore", divide="ignore"):
        return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def _numbers(
    items: "bpy.types.bpy_prop_collection[Any]", name: str, width: int = 1, kind: type = np.int32
) -> np.ndarray:
    """A property of all items as an array (n,) or (n, width)."""
    values: np.ndarray = np.empty(len(items) * width, kind)
    items.foreach_get(name, values)
    return values if width == 1 else values.reshape(-1, width)
