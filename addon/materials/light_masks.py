# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks for the light at a point: which rays see the diffraction, and which lamps light it."""

from ..lamps.lamp_group import Light
from ..nodes.builder import Tree, Value


def is_unseen(tree: Tree) -> Value:
    """1 for rays that would hit the diffraction by chance and cause fireflies, else 0.

    The camera sees the diffraction, also in mirrors and through clear glass. Rays scattered in a random direction by a
    rough surface or fog do not see it, nor do diffuse bounces that a mirror reflects."""
    path = tree.outputs_of(tree.node("ShaderNodeLightPath"))
    mirrored = tree.math("GREATER_THAN", path["Is Singular Ray"], path["Diffuse Depth"])
    return tree.math("LESS_THAN", path["Is Camera Ray"] + mirrored, 0.5)


def is_lit(tree: Tree, light: Light, *, n: Value, cos_r: Value, unseen: Value) -> Value:
    """1 if the lamp and the viewer are above the surface, the lamp is on, and the ray may see the diffraction; else 0.

    The numbers are compared with `unseen`, which is 1 for rays that must not see it, as no cosine exceeds 1."""
    least = tree.minimum(tree.minimum(cos_r, tree.dot(light.direction, n)), tree.dot(light.irradiance, (1.0, 1.0, 1.0)))
    return tree.math("GREATER_THAN", least, unseen)
