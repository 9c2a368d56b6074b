# SPDX-License-Identifier: GPL-3.0-or-later
"""The corner of a glass terrarium: two panes, their polished edges, the seal between them, and the table outside."""

from __future__ import annotations

import bpy
import numpy as np

from .ground import Walls
from .snake import plain_material
from .stage import add_plane, add_surface

CORNER = Walls(-0.185, 0.165)
TINT = (0.93, 0.975, 0.955)
_LONG_M, _HIGH_M, _PANE_M, _SEAL_M = 0.75, 0.16, 0.005, 0.006
_TABLE_M = -0.03


def add_corner(scene: bpy.types.Scene, corner: Walls = CORNER) -> None:
    """Two panes that meet at the left and the back, upright on a table."""
    x, y = corner
    glass, edge = _thin_glass(), plain_material("Glass Edge", (0.012, 0.045, 0.032), 0.2)
    silicone = plain_material("Silicone", (0.012, 0.012, 0.013), 0.35)
    low, high = _TABLE_M, _HIGH_M
    panes = {
        "Pane Left": [(x, y - _LONG_M, low), (x, y, low), (x, y, high), (x, y - _LONG_M, high)],
        "Pane Back": [(x, y, low), (x + _LONG_M, y, low), (x + _LONG_M, y, high), (x, y, high)],
    }
    for name, points in panes.items():
        pane = add_surface(scene, name, points, faces=[(0, 1, 2, 3)], material=glass)
        # A pane's shadow would only dim the soil a little, and EEVEE takes minutes for it.
        pane.visible_shadow = False
    t = _PANE_M
    _add_box(scene, "Pane Edge Left", (x - t, y - _LONG_M, high), (x, y + t, high + 0.0005), edge)
    _add_box(scene, "Pane Edge Back", (x, y, high), (x + _LONG_M, y + t, high + 0.0005), edge)
    s = _SEAL_M
    upright = [(x, y), (x + s, y), (x, y - s)]
    points = [(*place, z) for z in (low, high) for place in upright]
    add_surface(scene, "Seal", points, faces=_PRISM, material=silicone)
    table = plain_material("Table", (0.05, 0.043, 0.037), 1.0, specular=0.0)
    add_plane(scene, "Table", 4.0, table, z=low)


_PRISM = ((0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))


def _add_box(
    scene: bpy.types.Scene,
    name: str,
    low: tuple[float, float, float],
    high: tuple[float, float, float],
    material: bpy.types.Material,
) -> None:
    ends = np.array([low, high])
    points = [(ends[i, 0], ends[j, 1], ends[k, 2]) for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    add_surface(scene, name, points, faces=faces, material=material)


def _thin_glass() -> bpy.types.Material:
    """A pane as one surface: what it does not reflect passes straight on. Refraction would turn the light behind it
    into caustics, which Cycles finds only by chance."""
    material = plain_material("Thin Glass", (1.0, 1.0, 1.0), 0.0)
    material.surface_render_method = "BLENDED"
    nodes, links = material.node_tree.nodes, material.node_tree.links
    fresnel, both, passed, mirror, mixed = (
        nodes.new(f"ShaderNode{kind}") for kind in ("Fresnel", "Math", "BsdfTransparent", "BsdfGlossy", "MixShader")
    )
    fresnel.inputs["IOR"].default_value = 1.5
    # Both faces of the pane reflect.
    both.operation, both.inputs[1].default_value, both.use_clamp = "MULTIPLY", 1.9, True
    passed.inputs["Color"].default_value = (*TINT, 1.0)
    mirror.inputs["Roughness"].default_value = 0.0
    links.new(fresnel.outputs[0], both.inputs[0])
    for socket, output in zip(mixed.inputs, (both.outputs[0], passed.outputs[0], mirror.outputs[0]), strict=True):
        links.new(output, socket)
    links.new(mixed.outputs[0], nodes["Material Output"].inputs["Surface"])
    nodes.remove(nodes["Principled BSDF"])
    return material
