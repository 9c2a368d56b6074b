# SPDX-License-Identifier: GPL-3.0-or-later
"""A grating's variation over a skin, as nodes: the share of each relief at a point, and the turn of the direction
there. Unused variation adds no nodes.

A pattern is a number x, distributed uniformly from 0 to 1 over the surface. Each relief takes an interval of this range
as long as its share of the surface: with shares s1, s2, s3 the bounds are b1 = s1 and b2 = s1 + s2, and the shares at a
point are

    1 - S(x - b1),  S(x - b1) - S(x - b2),  S(x - b2)

S is a step from 0 to 1 over the softness. The shares add up to 1 everywhere. Patches are wider than the coherence
length, so light from different patches does not interfere: their radiances are added, weighted by the shares."""

from itertools import pairwise

from ..gratings.variation import Variation
from ..nodes.builder import Tree, Value

# With this detail, a Noise Texture is almost normally distributed around 0.5. Its distribution function, within 0.015,
# is (1 + tanh(k (noise - 0.5))) / 2, which makes it uniform.
_DETAIL, _EVEN = 1.0, 8.5
# Positions before modifiers and shape keys; Blender stores them if this is enabled on the object.
REST_POSITION = "rest_position"


def variation_nodes(tree: Tree, variation: Variation) -> tuple[list[Value | None], Value | None]:
    """The share of each relief at a point, where None is 1; and the turn of the direction in radians, or None."""
    name = variation.pattern_attribute
    by_noise = variation.shares and not name
    place, turning = _noise(tree, variation.size_m) if by_noise or variation.turn else (None, None)
    turn = (turning * 2.0 - 1.0) * variation.turn if turning is not None and variation.turn else None
    if not variation.shares:
        return [None], turn
    if name:
        held = tree.node("ShaderNodeAttribute", attribute_type="GEOMETRY", attribute_name=name, label=name)
        place = tree.value(held.outputs["Fac"])
    assert place is not None
    bound, beyond = 1.0 - sum(variation.shares), []
    for share in variation.shares:
        beyond.append(_step(tree, place, bound, variation.softness))
        bound += share
    return [1.0 - beyond[0], *(a - b for a, b in pairwise(beyond)), beyond[-1]], turn


def _noise(tree: Tree, size_m: float) -> tuple[Value, Value]:
    """Two independent numbers that vary over the surface, each uniform from 0 to 1. They use the rest position where it
    is stored, so that the pattern moves with a deforming skin."""
    held, _ = tree.attribute(REST_POSITION, "GEOMETRY")
    absent = tree.math("LESS_THAN", tree.dot(held, held), 1e-24)
    place = held + tree.value(tree.node("ShaderNodeTexCoord").outputs["Object"]) * absent
    noise = tree.node("ShaderNodeTexNoise", place)
    tree.feed(noise.inputs["Scale"], 1.0 / size_m)
    tree.feed(noise.inputs["Detail"], _DETAIL)
    red, green, _ = tree.node("ShaderNodeSeparateXYZ", tree.value(noise.outputs["Color"])).outputs
    first, second = (
        tree.math("TANH", tree.value(channel).times_plus(_EVEN, -_EVEN / 2)).times_plus(0.5, 0.5)
        for channel in (red, green)
    )
    return first, second


def _step(tree: Tree, place: Value, bound: float, softness: float) -> Value:
    """A step from 0 to 1 at a bound, smooth over the softness."""
    if softness <= 0:
        return tree.math("GREATER_THAN", place, bound)
    ends = (bound - softness / 2, bound + softness / 2)
    node = tree.node("ShaderNodeMapRange", place, *ends, 0.0, 1.0, interpolation_type="SMOOTHSTEP")
    return tree.value(node.outputs["Result"])
