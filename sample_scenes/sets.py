# SPDX-License-Identifier: GPL-3.0-or-later
"""The sets on which the animal is shown: soil with bark, soil with a shed skin, a terrarium's corner, a grey plate."""

from __future__ import annotations

from math import radians

import bmesh
import bpy
import numpy as np

from .bark import Placed, add_bark
from .lookdev import add_plate, stops_for_grey
from .noise import fractal_noise
from .soil import add_soil
from .terrarium import CORNER, add_corner

_SHED_MM, _SHED_FACES = 90.0, 40_000
_TUBE_M, _FLATTENED = 0.014, 0.6
_SOILED = (0.42, 0.38, 0.33)


def add_set(scene: bpy.types.Scene, name: str, snake: bpy.types.Object, species: str) -> None:
    """Add the set of this name around a snake of this species that lies on the floor z = 0."""
    SETS[name](scene, snake, species)


def stops(scene: bpy.types.Scene, name: str) -> float:
    """How many stops more the camera should expose for this set than for soil, once the lamps are there."""
    return stops_for_grey(scene) if name == "turntable" else 0.0


def _soil(scene: bpy.types.Scene, snake: bpy.types.Object, _: str) -> None:
    add_soil(scene, [snake, add_bark(scene)])


def _shed(scene: bpy.types.Scene, snake: bpy.types.Object, species: str) -> None:
    add_soil(scene, [snake, _add_shed(species, (0.025, -0.101), 10.0)])


def _terrarium(scene: bpy.types.Scene, snake: bpy.types.Object, species: str) -> None:
    bark = add_bark(scene, Placed(0.17, 0.125, -6.0, sunk_m=0.012))
    add_soil(scene, [snake, bark, _add_shed(species, (-0.06, -0.13), 20.0)], walls=CORNER)
    add_corner(scene)


def _plate(scene: bpy.types.Scene, *_: object) -> None:
    add_plate(scene)


SETS = {"soil": _soil, "shed": _shed, "terrarium": _terrarium, "turntable": _plate}


def _add_shed(species: str, place: tuple[float, float], turn_deg: float) -> bpy.types.Object:
    """A torn, crumpled tube of shed skin, open below, a little over the soil."""
    bpy.ops.grating.add_shed_skin(species=species, size_mm=_SHED_MM, faces=_SHED_FACES)
    shed = bpy.context.object
    points = np.empty(3 * len(shed.data.vertices), np.float32)
    shed.data.vertices.foreach_get("co", points)
    x, y, z = points.reshape(-1, 3).astype(float).T
    flat = np.stack([x, y], axis=1)
    torn = 1 + 0.16 * fractal_noise(flat / 0.014, 3, 4)
    radius = _TUBE_M * (1 + 0.15 * fractal_noise(x[:, None] / 0.025, 2, 1))
    turned = y / radius
    height = radius + z + 0.005 * fractal_noise(flat / (0.02, 0.011), 3, 2)
    bent = np.stack([x, height * np.sin(turned), _FLATTENED * height * np.cos(turned)], axis=1)
    shed.data.vertices.foreach_set("co", bent.astype(np.float32).ravel())
    _cut_away(shed.data, np.maximum(np.abs(x) / 0.9, np.abs(y)) * torn > 0.4e-3 * _SHED_MM)
    _darken(shed.active_material)
    shed.location = (*place, 0.0)
    shed.rotation_euler.z = radians(turn_deg)
    return shed


def _darken(material: bpy.types.Material) -> None:
    """Darken the colour of a shed skin, which would be overexposed beside dark soil."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    colour = next(node for node in nodes if node.type == "BSDF_PRINCIPLED").inputs["Base Color"]
    darker = nodes.new("ShaderNodeVectorMath")
    darker.operation, darker.inputs[1].default_value = "MULTIPLY", _SOILED
    links.new(colour.links[0].from_socket, darker.inputs[0])
    links.new(darker.outputs[0], colour)


def _cut_away(mesh: bpy.types.Mesh, gone: np.ndarray) -> None:
    """Remove vertices (n,) and their faces."""
    shape = bmesh.new()
    shape.from_mesh(mesh)
    away = [vertex for vertex, cut in zip(shape.verts, gone.tolist(), strict=True) if cut]
    bmesh.ops.delete(shape, geom=away, context="VERTS")
    shape.to_mesh(mesh)
    shape.free()
