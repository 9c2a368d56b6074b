# SPDX-License-Identifier: GPL-3.0-or-later
"""Lamps too wide for a bake's table: the table and a closure share them."""

from collections.abc import Iterable
from dataclasses import replace

import bpy

from ..lamps.area_lamp import SHAPE, WholeLamp, lamp_and_point
from ..lamps.lamp_group import LAMP_OUTPUTS, Light, light_of, shared_group
from ..nodes.builder import Operand, Tree, Value
from ..nodes.interface import Socket

# 1 - cos of the angle from a lamp's centre to the rim of its cone, over the variance of its disc.
_CONE = 3.0
# Variances in rad2: lights up to the first are shown by the table alone, from the second on by the closure alone. They
# are the variances of discs with radii of 9 and 12.5 degrees.
_WIDE = (0.006, 0.012)
# The same of an area lamp, over those of other lights: 24 and 33 degrees. Its random points have its shape.
_AREA = 7.0
_NAME = "Light Left by Table"
_DIRECTION = Socket("Direction", "Vector", "Unit vector to where a closure looks")
_LIGHT = (*LAMP_OUTPUTS[:3], Socket("Share", "Float", "The share of the lamp that the table shows"))
_LEFT = Socket("Left", "Float", "The share of the light from there that is left for a closure")


def lamp_for_table(tree: Tree, index: int, linked: bool, *, is_area: bool, coloured: bool) -> tuple[Light, Light]:
    """Add nodes for the scene's lamp `index`: the lamp for closures, and its light as the table shows it. `linked`:
    apply light linking. `is_area`: it may be an area lamp, which takes a hundred nodes more. `coloured`: it may be of
    another spectrum than white."""
    if not is_area:
        light = light_of(tree, index, linked, coloured=coloured)
        return light, light
    lamp, point = lamp_and_point(tree, index, linked, coloured=coloured)
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
        given: dict[str, Operand] = {_DIRECTION.name: direction}
        held = light.direction, light.irradiance, light.variance, share
        given |= {socket.name: value for socket, value in zip(_LIGHT, held, strict=True)}
        if isinstance(light, WholeLamp):
            shape = light.is_area, light.is_round, light.away, *light.axes
            given |= {socket.name: value for socket, value in zip(SHAPE, shape, strict=True)}
        left = left * tree.group(left_group(), given)[_LEFT.name]
    return left


def left_group() -> bpy.types.NodeTree:
    """The file's group of the light that a lamp leaves for a closure, created if needed."""
    return shared_group(_NAME, (_DIRECTION, *_LIGHT, *SHAPE), (_LEFT,), build=_add_left)


def _add_left(tree: Tree) -> None:
    """The nodes of the group."""
    direction, towards, irradiance, variance, share, *shape = tree.inputs().values()
    is_area, is_round, away, z, x, y = shape
    lamp = WholeLamp(towards, irradiance, variance, 0.0, share, is_area, is_round, away, (z, x, y))
    shines = tree.math("GREATER_THAN", tree.dot(irradiance, (1.0, 1.0, 1.0)), 0.0)
    beside = variance.times_plus(_CONE, tree.dot(towards, direction))  # above 1 within the cone
    within = tree.math("GREATER_THAN", beside, 1.0)
    within = (lamp.is_met(direction) - within) * is_area + within
    tree.output(1.0 - shines * share * within)
