# SPDX-License-Identifier: GPL-3.0-or-later
"""What counts of the light at a point: which rays see it, which lamps are up, and which of it the table answers to."""

from collections.abc import Iterable

from ..lamps.lamp_group import Light
from ..nodes.builder import Tree, Value

# 1 - cos of the angle from a lamp's middle to the rim of its cone, over the variance of its disc.
_CONE = 3.0
# The variances in rad2 of the widest light that is the table's alone and of the least wide that is the closure's: those
# of discs with radii of 9 and 12.5 degrees.
_WIDE = (0.006, 0.012)


def table_share(tree: Tree, light: Light) -> Value:
    """The share of a light that the table answers to: all of a compact one's, and none of a wide one's.

    The table takes each light for a round Gaussian. The closure finds a wide light as it is, and often."""
    compact, wide = _WIDE
    node = tree.node("ShaderNodeMapRange", light.variance, compact, wide, 1.0, 0.0, interpolation_type="SMOOTHSTEP")
    return tree.value(node.outputs["Result"])


def left_by_table(tree: Tree, lights: Iterable[tuple[Light, Value]], direction: Value) -> Value | float:
    """The share of the light from a direction that the table does not answer to: 0 where it leads to a lamp that
    shines, or what the table leaves of that lamp, and else 1."""
    left: Value | float = 1.0
    for light, share in lights:
        shines = tree.math("GREATER_THAN", tree.dot(light.irradiance, (1.0, 1.0, 1.0)), 0.0)
        beside = light.variance.times_plus(_CONE, tree.dot(light.direction, direction))  # within the cone above 1
        left = left * (1.0 - shines * share * tree.math("GREATER_THAN", beside, 1.0))
    return left


def is_unseen(tree: Tree) -> Value:
    """1 for rays that would find the glow by chance, as white dots on the floor; else 0.

    Seen is what the camera sees, also in mirrors and through clear glass. A ray that a rough surface or fog has sent
    in a random direction sees nothing, nor does a diffuse bounce that a mirror sends on."""
    path = tree.outputs_of(tree.node("ShaderNodeLightPath"))
    mirrored = tree.math("GREATER_THAN", path["Is Singular Ray"], path["Diffuse Depth"])
    return tree.math("LESS_THAN", path["Is Camera Ray"] + mirrored, 0.5)


def is_lit(tree: Tree, light: Light, *, n: Value, cos_r: Value, unseen: Value) -> Value:
    """1 where lamp and viewer are above the surface, the lamp sends light, and the ray may see it; else 0.

    All three numbers must be positive. `unseen` is 1 for a ray that may not, and no cosine exceeds 1."""
    least = tree.minimum(tree.minimum(cos_r, tree.dot(light.direction, n)), tree.dot(light.irradiance, (1.0, 1.0, 1.0)))
    return tree.math("GREATER_THAN", least, unseen)
