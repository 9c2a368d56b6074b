# SPDX-License-Identifier: GPL-3.0-or-later
"""Where rays through the pixels of a camera's picture or of a 3D view meet meshes that show gratings, and the grating's
tangent frame there."""

import math
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from math import cos, sin
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

from ...precompute.base.failure import GratingError
from ..direction.tangents import frame_field, own_angle
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
        if not hit or thing is None or thing.type != "MESH":
            continue
        if (place := (thing, tuple(map(tuple, matrix)))) in foreign:
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
        key = (*place, slot)
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


# Border around the boxes, as a fraction of the picture.
_AROUND = 0.01


@dataclass(frozen=True)
class Window:
    """A rectangle of a picture, in coordinates from 0 to 1 along x and y."""

    low: tuple[float, float] = (0.0, 0.0)
    high: tuple[float, float] = (1.0, 1.0)


class Pixels:
    """Converts the pixels of a camera's picture to rays into the scene."""

    def __init__(self, scene: bpy.types.Scene, camera: bpy.types.Object) -> None:
        render, place = scene.render, camera.matrix_world
        # As in renders, the camera's scale is ignored.
        self._axes = np.array(place.to_quaternion().to_matrix())
        self._origin = np.array(place.translation)
        self._kind = camera.data.type
        right_top, _, left_bottom, _ = (np.array(corner) for corner in camera.data.view_frame(scene=scene))
        self._corner, self._span = left_bottom, right_top - left_bottom
        share = render.resolution_percentage / 100
        self.size = tuple(max(1, int(side * share)) for side in (render.resolution_x, render.resolution_y))

    def rays(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Origins (n, 3) and unit directions (n, 3) of the rays through picture coordinates (n, 2) from 0 to 1. Every
        panorama is treated as a full equirectangular one."""
        if self._kind == "PANO":
            around, up = (0.5 - at[:, 0]) * 2 * math.pi, (at[:, 1] - 0.5) * math.pi
            own = np.stack([-np.cos(up) * np.sin(around), np.sin(up), -np.cos(up) * np.cos(around)], axis=1)
            origins = np.zeros(own.shape)
        else:
            own = self._corner + np.c_[at, np.zeros(len(at))] * self._span
            origins = np.zeros(own.shape)
            if self._kind == "ORTHO":
                origins, own = own * (1.0, 1.0, 0.0), np.broadcast_to((0.0, 0.0, -1.0), own.shape)
        directions = own @ self._axes.T
        return origins @ self._axes.T + self._origin, directions / np.linalg.norm(directions, axis=1, keepdims=True)

    @property
    def up(self) -> np.ndarray:
        """The unit vector (3,) that points up in the picture."""
        return self._axes[:, 1]

    @property
    def right(self) -> np.ndarray:
        """The unit vector (3,) that points to the right in the picture."""
        return self._axes[:, 0]

    @property
    def lens(self) -> np.ndarray | None:
        """The place (3,) of a perspective camera's lens; None for another camera."""
        return self._origin if self._kind == "PERSP" else None

    def shows(self, points: np.ndarray) -> np.ndarray:
        """Whether points (n, 3) lie in the picture, in front of the camera, (n,). A panorama shows all."""
        if self._kind == "PANO":
            return np.ones(len(points), bool)
        own = (points - self._origin) @ self._axes
        in_front = own[:, 2] < -1e-6
        if self._kind == "PERSP":
            own = own * (self._corner[2] / np.where(in_front, own[:, 2], -1.0))[:, None]
        at = (own - self._corner)[:, :2] / self._span[:2]
        return in_front & ((at >= 0) & (at <= 1)).all(axis=1)

    def places(self, window: Window, count: int) -> np.ndarray:
        """The centres of about `count` pixels on a grid in a window, (n, 2), in picture coordinates from 0 to 1. In a
        panorama they cover equal areas of the sky."""
        (x0, y0), (x1, y1) = window.low, window.high
        wide, high = (x1 - x0) * self.size[0], (y1 - y0) * self.size[1]
        columns = max(1, round(math.sqrt(count * wide / high)))
        rows = max(1, round(count / columns))
        x, y = np.meshgrid(x0 + (np.arange(columns) + 0.5) / columns * (x1 - x0), (np.arange(rows) + 0.5) / rows)
        y = np.arcsin(2 * y - 1) / math.pi + 0.5 if self._kind == "PANO" else y0 + y * (y1 - y0)
        at = np.stack([x.ravel(), y.ravel()], axis=1) * self.size
        return (np.floor(np.minimum(at, np.array(self.size) - 0.5)) + 0.5) / self.size

    def in_frame(self, points: np.ndarray) -> np.ndarray:
        """Whether points (n, 3) in world space are in the picture, (n,), covered or not."""
        own = (points - self._origin) @ self._axes
        if self._kind == "PANO":
            return np.ones(len(points), bool)
        ahead = own[:, 2] < 0
        if self._kind == "PERSP":
            own = own * (self._corner[2] / np.where(ahead, own[:, 2], -np.inf))[:, None]
        at = (own - self._corner)[:, :2] / self._span[:2]
        return ahead & ((at >= 0) & (at <= 1)).all(axis=1)

    def window_of(self, boxes: Iterable[tuple[np.ndarray, Matrix]]) -> Window | None:
        """The part of the picture that contains the given boxes, each as corners (8, 3) in object space and a matrix.
        None if none is in the picture; the whole picture for a panorama, or if a corner is behind a perspective
        camera."""
        found = []
        for corners, matrix in boxes:
            world = np.array(matrix)
            own = (corners @ world[:3, :3].T + world[:3, 3] - self._origin) @ self._axes
            if self._kind == "PANO" or (self._kind == "PERSP" and own[:, 2].max() > -1e-6):
                return Window()
            if self._kind == "PERSP":
                own = own * (self._corner[2] / own[:, 2:])
            at = (own - self._corner)[:, :2] / self._span[:2]
            low, high = np.clip((at.min(axis=0) - _AROUND, at.max(axis=0) + _AROUND), 0, 1)
            if (high > low).all():
                found.append((low, high))
        if not found:
            return None
        low, high = (np.array(ends) for ends in zip(*found, strict=True))
        return Window(tuple(low.min(axis=0)), tuple(high.max(axis=0)))


# The height of a 3D view's picture in pixels, where only its shape matters.
_HIGH = 1000
# The rays of an orthographic view begin this far behind its middle, in metres: the view shows what is behind it too.
_BEHIND_VIEW = 1e3


class ViewPixels(Pixels):
    """Converts the pixels of a 3D view, which has a size in pixels, to rays into the scene. Without a size, the picture
    has the view's shape."""

    def __init__(self, view: bpy.types.RegionView3D, size: tuple[int, int] | None = None) -> None:
        place, projection = np.array(view.view_matrix.inverted_safe()), np.array(view.window_matrix)
        is_flat = projection[3, 3] != 0
        self._kind = "ORTHO" if is_flat else "PERSP"
        self._axes = place[:3, :3]
        self._origin = place[:3, 3] + (_BEHIND_VIEW * self._axes[:, 2] if is_flat else 0.0)
        # The frame at a depth of 1, from the projection that maps it to -1 to 1.
        shift = -projection[:2, 3] if is_flat else projection[:2, 2]
        scale = np.array([projection[0, 0], projection[1, 1]])
        self._corner = np.array([*(shift - 1) / scale, -1.0])
        self._span = np.array([*2 / scale, 0.0])
        self.size = size or (max(1, round(_HIGH * scale[1] / scale[0])), _HIGH)


def seen_from(
    scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph, view: bpy.types.RegionView3D | None, *, from_view: bool
) -> Pixels:
    """The picture of the scene's camera, or of a 3D view if asked or if there is no camera. Raises GratingError if
    there is neither."""
    if from_view and view is not None:
        return ViewPixels(view)
    if scene.camera is not None and scene.camera.type == "CAMERA":
        return Pixels(scene, scene.camera.evaluated_get(depsgraph))
    if view is None:
        raise GratingError(f"scene {scene.name}", "no camera", "add one and make it the scene's camera")
    return ViewPixels(view)
