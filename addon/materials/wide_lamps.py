# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps too wide for a bake's table: the table and a closure share them."""

from collections.abc import Iterable
from dataclasses import replace

from ..lamps.area_lamp import WholeLamp, lamp_and_point
from ..lamps.lamp_group import Light
from ..nodes.builder import Tree, Value

# 1 - cos of the angle from a lamp's centre to the rim of its cone, over the variance of its disc.
_CONE = 3.0
# Variances in rad2: lights up to the first are shown by the table alone, from the second on by the closure alone. They
# are the variances of discs with radii of 9 and 12.5 degrees.
_WIDE = (0.006, 0.012)
# The same of an area lamp, over those of other lights: 24 and 33 degrees. Its random points have its shape.
_AREA = 7.0


def lamp_for_table(tree: Tree, index: int, linked: bool) -> tuple[Light, Light]:
    """Add nodes for the scene's lamp `index`: the lamp for closures, and its light as the table shows it. `linked`:
    apply light linking."""
    lamp, point = lamp_and_point(tree, index, linked)
    # The point has a small variance, for which table_share gives 1.
    shown = (table_share(tree, lamp) - 1.0) * lamp.is_area + 1.0
    return lamp, replace(point, irradiance=point.irradiance * shown)


def table_share(tree: Tree, light: Light) -> Value:
    """The share of a light that the table shows: 1 for a compact light, 0 for a wide one.

    The table treats each light as a round Gaussian. A closure samples a wide light's true shape, and hits it often."""
    compact, wide = _WIDE
    variance = light.variance
    if isinstance(light, WholeLamp):
        variance = variance * light.is_area.times_plus(1 / _AREA - 1, 1.0)
    node = tree.node("ShaderNodeMapRange", variance, compact, wide, 1.0, 0.0, interpolation_type="SMOOTHSTEP")
    return tree.value(node.outputs["Result"])


def left_by_table(tree: Tree, lights: Iterable[tuple[Light, Value | float]], direction: Value) -> Value | float:
    """The share of the light from a direction that is left for a closure: 1 minus the share of a lamp there that the
    table shows. A lamp with a share of 1 that the table does not show has no light at all."""
    left: Value | float = 1.0
    for light, share in lights:
        shines = tree.math("GREATER_THAN", tree.dot(light.irradiance, (1.0, 1.0, 1.0)), 0.0)
        beside = light.variance.times_plus(_CONE, tree.dot(light.direction, direction))  # above 1 within the cone
        within = tree.math("GREATER_THAN", beside, 1.0)
        if isinstance(light, WholeLamp):
            within = (light.is_met(direction) - within) * light.is_area + within
        left = left * (1.0 - shines * share * within)
    return left
