# SPDX-License-Identifier: GPL-3.0-or-later
"""Loose soil: mounds, heaped against what lies on it and nowhere inside it, with crumbs and fibres on them. Near the
origin crumbs are instances of a few meshes, farther away a plane has bumps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from .noise import fractal_noise, value_noise
from .stage import add_object, add_plane, add_surface, plain_material

CELL_M = 0.001
# The soil's mean height over the floor z = 0, on which bodies lie: they seem sunk by as much.
LEVEL_M = 0.0028
# Soil stays this much below what lies on it.
_GAP_M = 0.0002
_HEAP_M, _HEAP_WIDTH_M = 0.008, 0.006
# Below this height a body counts as touching the soil.
_CONTACT_M = 0.0025
_BURIED_M = 0.0005
_DEEPEST_M = 0.006


class Body:
    """The surface of an object, in world space."""

    def __init__(self, thing: bpy.types.Object) -> None:
        bpy.context.view_layer.update()
        points = np.empty(3 * len(thing.data.vertices), np.float32)
        thing.data.vertices.foreach_get("co", points)
        matrix = np.array(thing.matrix_world)
        points = points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
        # The triangles that renderers see: a bent quad may be cut along either diagonal.
        triangles = np.empty(3 * len(thing.data.loop_triangles), np.int32)
        thing.data.loop_triangles.foreach_get("vertices", triangles)
        self._tree = BVHTree.FromPolygons(points.tolist(), triangles.reshape(-1, 3).tolist(), all_triangles=True)
        self.low, self.high = points.min(axis=0), points.max(axis=0)

    def underside(self, place: np.ndarray) -> np.ndarray:
        """The height of the lowest surface over each place (..., 2), or inf."""
        heights = np.full(place.shape[:-1], np.inf)
        near = np.nonzero(((place >= self.low[:2]) & (place <= self.high[:2])).all(axis=-1))
        start, upwards = self.low[2] - 0.01, Vector((0, 0, 1))
        hits = (self._tree.ray_cast(Vector((x, y, start)), upwards)[0] for x, y in place[near].tolist())
        heights[near] = [np.inf if hit is None else hit.z for hit in hits]
        return heights

    def is_apart(self, points: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Whether balls (n,) do not touch the surface, from its outside. Balls whose centre is deeper inside than
        _DEEPEST_M pass, so that the search is short."""
        reach = radius[:, None]
        free = np.ones(len(points), bool)
        near = np.nonzero(((points > self.low - reach) & (points < self.high + reach)).all(axis=1))[0]
        free[near] = [
            self._is_apart(Vector(point), r) for point, r in zip(points[near].tolist(), radius[near], strict=True)
        ]
        return free

    def _is_apart(self, point: Vector, radius: float) -> bool:
        surface, normal, _, distance = self._tree.find_nearest(point, max(radius, _DEEPEST_M))
        if surface is None:
            return True
        # The nearest place can be an edge, whose normal leaves open which side the point is on.
        above = self._tree.ray_cast(point, Vector((0, 0, 1)))[1]
        return distance > radius and (point - surface).dot(normal) > 0 and (above is None or above.z < 0)


@dataclass(frozen=True)
class Ground:
    """Heights of the soil, and of the lowest surface above it, at cells (y, x) of a square about the origin. The second
    is `inf` where nothing lies above. `bodies` are the surfaces that lie on the soil."""

    half_m: float
    height: np.ndarray
    underside: np.ndarray
    bodies: tuple[Body, ...]

    def cells(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The nearest cells of points (..., 2)."""
        nearest = np.rint((points + self.half_m) / CELL_M).astype(int).clip(0, len(self.height) - 1)
        return nearest[..., 1], nearest[..., 0]

    def below(self, points: np.ndarray) -> np.ndarray:
        """The soil's height below points (..., 2 or 3)."""
        return self.height[self.cells(points[..., :2])]

    def is_free(self, points: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Whether balls at points (n, 3) are outside of everything that lies on the soil, and below it."""
        below = points[:, 2] + radius <= self.underside[self.cells(points[:, :2])]
        return np.logical_and.reduce([below, *(body.is_apart(points, radius) for body in self.bodies)])


def ground_below(bodies: Sequence[bpy.types.Object], half_m: float, fade_m: float) -> Ground:
    """The soil within `half_m` of the origin. In the last `fade_m` it falls to below the floor."""
    axis = np.arange(-half_m, half_m + CELL_M / 2, CELL_M)
    x, y = np.meshgrid(axis, axis)
    place = np.stack([x, y], axis=-1)
    surfaces = tuple(Body(body) for body in bodies)
    underside = np.minimum.reduce([np.full(x.shape, np.inf), *(surface.underside(place) for surface in surfaces)])
    heaped = _blurred(underside < _CONTACT_M, _HEAP_WIDTH_M / CELL_M)
    mounds = 0.0016 * fractal_noise(place / 0.05, 3, seed=3) + 0.0008 * fractal_noise(place / 0.009, 2, seed=9)
    # Heaps are uneven along a body.
    height = LEVEL_M + mounds + _HEAP_M * heaped * (1 + 0.7 * fractal_noise(place / 0.018, 2, seed=5))
    edge = np.clip((half_m - np.hypot(x, y)) / fade_m, 0, 1)
    underside[underside < -_BURIED_M] = np.inf  # what is buried stays buried
    height = np.minimum(height * edge**0.5 - 0.0006 * (1 - edge), underside - _GAP_M)
    return Ground(half_m, height, underside, surfaces)


def _blurred(mask: np.ndarray, sigma: float) -> np.ndarray:
    """A mask blurred by a Gaussian of `sigma` cells."""
    reach = np.arange(-int(3 * sigma), int(3 * sigma) + 1)
    kernel = np.exp(-((reach / sigma) ** 2) / 2)
    kernel /= kernel.sum()
    blurred = mask.astype(float)
    for axis in (0, 1):
        blurred = np.apply_along_axis(np.convolve, axis, blurred, kernel, mode="same")
    return blurred


class Scattered(NamedTuple):
    """Places of n instances: points (n, 3), Euler angles (n, 3), sizes (n,), and the index of each one's mesh (n,)."""

    points: np.ndarray
    turns: np.ndarray
    sizes: np.ndarray
    kinds: np.ndarray


def instance_on_points(
    scene: bpy.types.Scene, name: str, places: Scattered, meshes: Sequence[bpy.types.Mesh]
) -> bpy.types.Object:
    """Add an object that shows one of the meshes at each place. The names of the meshes must sort in their order."""
    originals = bpy.data.collections.new(name)
    for mesh in meshes:
        originals.objects.link(bpy.data.objects.new(mesh.name, mesh))
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(places.points))
    mesh.vertices.foreach_set("co", places.points.astype(np.float32).ravel())
    for attribute, kind, field, values in (
        ("turn", "FLOAT_VECTOR", "vector", places.turns.astype(np.float32)),
        ("size", "FLOAT", "value", places.sizes.astype(np.float32)),
        ("kind", "INT", "value", places.kinds.astype(np.int32)),
    ):
        mesh.attributes.new(attribute, kind, "POINT").data.foreach_set(field, values.ravel())
    shown = add_object(scene, name, mesh)
    shown.modifiers.new("Scatter", "NODES").node_group = _scatter_nodes(name, originals)
    return shown


def _scatter_nodes(name: str, originals: bpy.types.Collection) -> bpy.types.NodeTree:
    """Geometry nodes that put an object of the collection on each vertex, as its attributes say."""
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.is_modifier = True
    for side in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=side, socket_type="NodeSocketGeometry")
    nodes, links = tree.nodes, tree.links
    points, shown = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    scatter, picked = nodes.new("GeometryNodeInstanceOnPoints"), nodes.new("GeometryNodeCollectionInfo")
    picked.inputs["Collection"].default_value = originals
    picked.inputs["Separate Children"].default_value = picked.inputs["Reset Children"].default_value = True
    scatter.inputs["Pick Instance"].default_value = True
    links.new(points.outputs[0], scatter.inputs["Points"])
    links.new(picked.outputs[0], scatter.inputs["Instance"])
    for attribute, kind, socket in (
        ("turn", "FLOAT_VECTOR", "Rotation"),
        ("size", "FLOAT", "Scale"),
        ("kind", "INT", "Instance Index"),
    ):
        read = nodes.new("GeometryNodeInputNamedAttribute")
        read.data_type = kind
        read.inputs["Name"].default_value = attribute
        links.new(read.outputs["Attribute"], scatter.inputs[socket])
    links.new(scatter.outputs[0], shown.inputs[0])
    return tree


# Less red than they look: the view transform deepens dark colours.
SOIL_DARK, SOIL_LIGHT = (0.011, 0.0058, 0.0046), (0.066, 0.0315, 0.0215)
# Between crumbs, where less light arrives.
_SHADED = (0.040, 0.019, 0.014)
# Colours of single crumbs, and the share of crumbs that are darker.
_CRUMB_COLOURS = (
    (0.0, (0.010, 0.0045, 0.0035)),
    (0.4, (0.042, 0.0175, 0.0125)),
    (0.9, (0.090, 0.038, 0.025)),
    (1.0, (0.12, 0.062, 0.036)),
)
_FIBRE_COLOUR = (0.10, 0.045, 0.025)
_BUMP_M = 0.0028
_NEAR_M, _FADE_M = 0.30, 0.12
_CRUMBS, _FIBRES = 170_000, 5200
_LEAST_M, _MOST_M = 0.0006, 0.0045
# How much rarer crumbs are that are larger: the density of diameters falls with this power.
_RARER = 3.7
_SMALL, _LARGE = 5, 9


def add_soil(scene: bpy.types.Scene, bodies: Sequence[bpy.types.Object] = (), *, half_size_m: float = 3.0) -> Ground:
    """A floor of crumbs, heaped against the bodies that lie on it; no crumb is inside of a body. Returns its
    heights."""
    add_plane(scene, "Soil", half_size_m, _bumps("Soil", SOIL_LIGHT))
    ground = ground_below(bodies, _NEAR_M, _FADE_M)
    _add_mounds(scene, ground, _bumps("Soil Mounds", _SHADED))
    rng = np.random.default_rng(11)
    instance_on_points(scene, "Soil Crumbs", _crumbs(ground, rng), _crumb_meshes(rng))
    _add_fibres(scene, ground, rng)
    return ground


def _add_mounds(scene: bpy.types.Scene, ground: Ground, material: bpy.types.Material) -> None:
    """The soil between the crumbs, as a mesh of every second cell."""
    height = ground.height[::2, ::2]
    columns = height.shape[1]
    axis = -ground.half_m + 2 * CELL_M * np.arange(columns)
    points = np.stack([*np.meshgrid(axis, axis), height], axis=-1).reshape(-1, 3)
    first = (np.arange(columns - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    quads = first[:, None] + (0, 1, columns + 1, columns)
    used, corners = np.unique(quads[points[quads, 2].max(axis=1) > 0], return_inverse=True)
    mounds = add_surface(scene, "Soil Mounds", points[used], faces=corners.reshape(-1, 4), material=material)
    mounds.data.shade_smooth()


def _crumbs(ground: Ground, rng: np.random.Generator) -> Scattered:
    """Where crumbs lie: denser near the origin, none inside of what lies on the soil."""
    reach = ground.half_m * rng.random(_CRUMBS) ** 0.7
    turn = rng.uniform(0, 2 * np.pi, _CRUMBS)
    place = np.stack([reach * np.cos(turn), reach * np.sin(turn)], axis=1)
    power = 1 - _RARER
    least, most = (_LEAST_M / 2) ** power, (_MOST_M / 2) ** power
    radius = (least + rng.random(_CRUMBS) * (most - least)) ** (1 / power)
    below = ground.below(place)
    height = below + radius * rng.uniform(-0.2, 1.0, _CRUMBS) + 0.0006 * rng.random(_CRUMBS)
    # Crumbs under an overhang lie lower; under a belly there is no room for them.
    height = np.minimum(height, ground.underside[ground.cells(place)] - 1.001 * radius)
    points = np.column_stack([place, height])
    kept = (height > below - 0.7 * radius) & (height > 0)
    kept[kept] = ground.is_free(points[kept], radius[kept])
    kind = np.where(radius > 0.0007, _SMALL + rng.integers(_LARGE, size=_CRUMBS), rng.integers(_SMALL, size=_CRUMBS))
    turns = rng.uniform(0, 2 * np.pi, (_CRUMBS, 3))
    return Scattered(points[kept], turns[kept], radius[kept], kind[kept])


def _crumb_meshes(rng: np.random.Generator) -> list[bpy.types.Mesh]:
    """Angular lumps within a ball of radius 1: small ones of few faces, then large ones."""
    material = _crumb_material()
    meshes = []
    for index in range(_SMALL + _LARGE):
        mesh = bpy.data.meshes.new(f"Crumb {index:02}")
        points, faces = _icosphere(0 if index < _SMALL else 1)
        seed = rng.uniform(0, 100, 3)
        # A few planes cut the ball, and noise breaks the cuts.
        normals = rng.normal(size=(7, 3))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        cut = (rng.uniform(0.4, 0.8, 7) / np.maximum(points @ normals.T, 1e-6)).min(axis=1)
        rough = 1 + 0.3 * value_noise(points * 2.1 + seed) + 0.12 * value_noise(points * 4.7 + seed)
        points = points * (np.minimum(1, cut) * rough)[:, None] * (1, rng.uniform(0.45, 1), rng.uniform(0.35, 0.8))
        points /= np.linalg.norm(points, axis=1).max()
        mesh.from_pydata(points.tolist(), [], faces.tolist())
        mesh.materials.append(material)
        meshes.append(mesh)
    return meshes


def _icosphere(subdivisions: int) -> tuple[np.ndarray, np.ndarray]:
    """Points and triangles of a ball of radius 1."""
    g = (1 + 5**0.5) / 2
    points = np.array([(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0)], float)
    points = np.concatenate([points, np.roll(points, 1, axis=1), np.roll(points, 2, axis=1)])
    faces = np.array(
        [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6)]
        + [(7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10)]
        + [(8, 6, 7), (9, 8, 1)]
    )
    for _ in range(subdivisions):
        edges = np.sort(faces[:, ((0, 1), (1, 2), (2, 0))], axis=-1)
        pairs, middle = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
        middle = len(points) + middle.reshape(-1, 3)
        points = np.concatenate([points, points[pairs].mean(axis=1)])
        a, b, c = faces.T
        ab, bc, ca = middle.T
        faces = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
    return points / np.linalg.norm(points, axis=1, keepdims=True), faces


def _add_fibres(scene: bpy.types.Scene, ground: Ground, rng: np.random.Generator, joints: int = 8) -> None:
    """Thin bent fibres that lie over the crumbs."""
    reach = 0.8 * ground.half_m * np.sqrt(rng.random(_FIBRES))
    turn, heading = rng.uniform(0, 2 * np.pi, (2, _FIBRES))
    length = rng.uniform(0.002, 0.011, _FIBRES)
    bends = np.cumsum(rng.normal(0, 0.25, (_FIBRES, joints)), axis=1) + heading[:, None]
    steps = np.stack([np.cos(bends), np.sin(bends)], axis=-1) * (length / joints)[:, None, None]
    line = np.stack([reach * np.cos(turn), reach * np.sin(turn)], axis=-1)[:, None] + np.cumsum(steps, axis=1)
    thick = rng.uniform(0.00004, 0.00012, _FIBRES)
    # Fibres bridge hollows: the mean height along them, with an arch.
    arch = 0.0012 * rng.random(_FIBRES)[:, None] * np.sin(np.linspace(0, np.pi, joints))
    height = (ground.below(line) + ground.below(line).max(axis=1, keepdims=True)) / 2 + 0.0006 + arch
    joined = np.dstack([line, height]).reshape(-1, 3)
    free = ground.is_free(joined, np.full(len(joined), _LEAST_M)).reshape(height.shape).all(axis=1)
    line, height, thick = line[free], height[free], thick[free]
    side = np.stack([-np.sin(bends), np.cos(bends)], axis=-1)[free]
    corners = []
    for around in 2 * np.pi * np.arange(3) / 3:
        flat = line + side * (thick * np.cos(around))[:, None, None]
        corners.append(np.dstack([flat, height + (thick * np.sin(around))[:, None]]))
    points = np.stack(corners, axis=2)  # fibre, joint, corner
    index = np.arange(points.size // 3).reshape(points.shape[:3])
    turned = np.roll(index, -1, axis=2)
    quads = np.stack([index[:, :-1], turned[:, :-1], turned[:, 1:], index[:, 1:]], axis=-1)
    material = plain_material("Fibre", _FIBRE_COLOUR, 1.0, specular=0.0)
    fibres = add_surface(scene, "Soil Fibres", points.reshape(-1, 3), faces=quads.reshape(-1, 4), material=material)
    fibres.data.shade_smooth()


def _crumb_material() -> bpy.types.Material:
    """A matt material that gives each instance its own colour."""
    material = plain_material("Crumb", SOIL_DARK, 1.0, specular=0.0)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader = nodes["Principled BSDF"]
    instance, damp, darker, shade, ramp = (
        nodes.new(f"ShaderNode{kind}") for kind in ("ObjectInfo", "TexNoise", "Math", "Math", "ValToRGB")
    )
    # Neighbours differ, and patches of the soil are damp and darker.
    damp.inputs["Scale"].default_value = 28.0
    darker.operation, darker.inputs[1].default_value, darker.use_clamp = "MULTIPLY", 1.9, True
    shade.operation = "MULTIPLY"
    links.new(instance.outputs["Location"], damp.inputs["Vector"])
    links.new(damp.outputs[0], darker.inputs[0])
    links.new(instance.outputs["Random"], shade.inputs[0])
    links.new(darker.outputs[0], shade.inputs[1])
    elements = ramp.color_ramp.elements
    while len(elements) < len(_CRUMB_COLOURS):
        elements.new(0.5)
    for element, (place, colour) in zip(elements, _CRUMB_COLOURS, strict=True):
        element.position, element.color = place, (*colour, 1.0)
    links.new(shade.outputs[0], ramp.inputs[0])
    links.new(ramp.outputs["Color"], shader.inputs["Base Color"])
    return material


def _bumps(name: str, light: tuple[float, float, float]) -> bpy.types.Material:
    """Crumbs as colour and bumps: Voronoi cells of two sizes, distorted by noise."""
    material = plain_material(name, SOIL_DARK, 1.0, specular=0.0)
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader = nodes["Principled BSDF"]
    noise, ramp, bump, where, moved, height = (
        nodes.new(f"ShaderNode{kind}") for kind in ("TexNoise", "ValToRGB", "Bump", "TexCoord", "VectorMath", "Math")
    )
    links.new(where.outputs["Object"], noise.inputs["Vector"])
    noise.inputs["Scale"].default_value, noise.inputs["Detail"].default_value = 90.0, 6.0
    moved.operation, height.operation = "MULTIPLY_ADD", "MULTIPLY_ADD"
    links.new(noise.outputs["Color"], moved.inputs[0])
    moved.inputs[1].default_value = (_BUMP_M,) * 3
    links.new(where.outputs["Object"], moved.inputs[2])
    # Distance to the nearest cell centre: coarse crumbs plus a third of the fine ones.
    for cells, per_crumb in ((height.inputs[0], 1.0), (height.inputs[2], 3.0)):
        crumbs = nodes.new("ShaderNodeTexVoronoi")
        crumbs.inputs["Scale"].default_value = per_crumb / _BUMP_M
        links.new(moved.outputs["Vector"], crumbs.inputs["Vector"])
        links.new(crumbs.outputs["Distance"], cells)
    height.inputs[1].default_value = 3.0
    links.new(noise.outputs[0], ramp.inputs[0])
    for element, place, colour in zip(ramp.color_ramp.elements, (0.35, 0.7), (SOIL_DARK, light), strict=True):
        element.position, element.color = place, (*colour, 1.0)
    links.new(ramp.outputs["Color"], shader.inputs["Base Color"])
    bump.invert = True
    bump.inputs["Distance"].default_value, bump.inputs["Strength"].default_value = _BUMP_M / 4, 1.0
    links.new(height.outputs[0], bump.inputs["Height"])
    links.new(bump.outputs["Normal"], shader.inputs["Normal"])
    return material
