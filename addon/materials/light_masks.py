# SPDX-License-Identifier: GPL-3.0-or-later
"""Masks for the light at a point: which rays see the diffraction, which lamps light it, and what the closures add."""

from collections.abc import Iterable

from ..lamps.lamp_group import Light
from ..nodes.builder import Tree, Value

# 1 - cos of the angle from a lamp's centre to the rim of its cone, over the variance of its disc.
_CONE = 3.0
# Variances in rad2: lights up to the first are shown by the table alone, from the second on by the closure alone. They
# are the variances of discs with radii of 9 and 12.5 degrees.
_WIDE = (0.006, 0.012)


def table_share(tree: Tree, light: Light) -> Value:
    """The share of a light that the table shows: 1 for a compact light, 0 for a wide one.

    The table treats each light as a round Gaussian. A closure samples a wide light's true shape, and hits it often."""
    compact, wide = _WIDE
    node = tree.node("ShaderNodeMapRange", light.variance, compact, wide, 1.0, 0.0, interpolation_type="SMOOTHSTEP")
    return tree.value(node.outputs["Result"])


def left_by_table(tree: Tree, lights: Iterable[tuple[Light, Value]], direction: Value) -> Value | float:
    """The share of the light from a direction that the table does not show: 1 minus its share of a lamp there."""
    left: Value | float = 1.0
    for light, share in lights:
        shines = tree.math("GREATER_THAN", tree.dot(light.irradiance, (1.0, 1.0, 1.0)), 0.0)
        beside = light.variance.times_plus(_CONE, tree.dot(light.direction, direction))  # above 1 within the cone
        left = left * (1.0 - shines * share * tree.math("GREATER_THAN", beside, 1.0))
    return left


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
