# SPDX-License-Identifier: GPL-3.0-or-later
"""Loose soil: crumbs and fibres, heaped against what lies on it. Near the origin they are geometry, farther away a
plane with bumps."""

from __future__ import annotations

from collections.abc import Sequence

import bpy
import numpy as np

from .ground import CELL_M, OPEN, Ground, Walls, ground_below
from .noise import value_noise
from .scatter import Scattered, instance_on_points
from .snake import plain_material
from .stage import add_surface

# Less red than they look: the view transform deepens dark colours.
SOIL_DARK, SOIL_LIGHT = (0.011, 0.0058, 0.0046), (0.066, 0.0315, 0.0215)
# Between crumbs, where less light arrives.
_SHADED = (0.032, 0.0155, 0.011)
# Colours of single crumbs, and the share of crumbs that are darker.
_CRUMB_COLOURS = (
    (0.0, (0.011, 0.006, 0.005)),
    (0.3, (0.036, 0.0175, 0.0125)),
    (0.8, (0.088, 0.042, 0.029)),
    (0.98, (0.145, 0.078, 0.048)),
    (1.0, (0.22, 0.14, 0.08)),
)
_FIBRE_COLOUR = (0.1, 0.056, 0.03)
_BUMP_M = 0.0028
_NEAR_M, _FADE_M = 0.30, 0.12
_CRUMBS, _FIBRES = 170_000, 2600
_LEAST_M, _MOST_M = 0.0006, 0.005
# How much rarer crumbs are that are larger: the density of diameters falls with this power.
_RARER = 3.2
_SMALL, _LARGE = 5, 9


def add_soil(
    scene: bpy.types.Scene, bodies: Sequence[bpy.types.Object] = (), *, walls: Walls = OPEN, half_size_m: float = 3.0
) -> Ground:
    """A floor of crumbs within the walls, heaped against the bodies that lie on it; no crumb is inside of a body.
    Returns its heights."""
    _add_plane(scene, walls, half_size_m, _bumps("Soil", SOIL_LIGHT))
    ground = ground_below(bodies, _NEAR_M, _FADE_M, walls=walls)
    _add_mounds(scene, ground, _bumps("Soil Mounds", _SHADED))
    rng = np.random.default_rng(11)
    instance_on_points(scene, "Soil Crumbs", _crumbs(ground, rng), _crumb_meshes(rng))
    _add_fibres(scene, ground, rng)
    return ground


def _add_plane(scene: bpy.types.Scene, walls: Walls, half_m: float, material: bpy.types.Material) -> None:
    """The floor z = 0 within the walls."""
    left, back = max(walls.x, -half_m), min(walls.y, half_m)
    points = [(left, -half_m, 0), (half_m, -half_m, 0), (half_m, back, 0), (left, back, 0)]
    add_surface(scene, "Soil", points, faces=[(0, 1, 2, 3)], material=material)


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
