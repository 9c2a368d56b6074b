# SPDX-License-Identifier: GPL-3.0-or-later
"""Packing a lamp into four properties of the scene: the drivers that write them and the nodes that read them.

Materials read the properties by their own drivers (lamp_group.py). All drivers are simple expressions that Blender
evaluates with auto-run of scripts off and without this extension. So diffraction follows every change of a lamp, and a
material appended to another scene follows the lamps of that scene.

The properties of lamp `i` are named `ng_key_<i>_<what>`. Each holds a vector, then a fourth number:

    place   unit vector to a sun; position of another lamp, m
            mean variance v of the lamp's disc along one axis: v in m2; for a sun -1 - v, v in rad2
    power   linear RGB: a sun's irradiance, W/m2; another lamp's radiant intensity along its axis, W/sr
            the lamp's x scale over its y scale, for an area lamp its height over its width; negative if it casts no
            shadow
    z       the lamp's z axis over its squared length
            cosine of the angle off the axis at which a spot begins to shine; 3 for an area lamp, -3 for others
    x       the lamp's x axis over its squared length; for an area lamp from its centre to its edge, m, or for a round
            one to that of the rectangle with the same variances
            cosine of the angle within which a spot has full brightness; 2 for an area lamp, 2.5 for a round one, -2
            for others

A lamp that may have another spectrum than white has a fifth property, `spectrum`: one number, its row in the table of
lamps (lamp_spectrum.py).

Diffraction Lamps read the properties from their own object by Attribute nodes. EEVEE searches for each attribute in a
separate loop in every pixel, so a white lamp has only four properties."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import bpy

from ..nodes.builder import Tree, Value
from .brightest_lamps import LAMPS_MAX, LEFT_OUT_MAX
from .drivers import Drivers, Variable
from .lamp_spectrum import is_coloured, row_expression
from .rendered_lamps import drive_on

PROPERTIES = ("place", "power", "z", "x")
# One number that the drivers of `power` read: 0 if the render does not show the lamp (rendered_lamps.py).
ON = "on"
# The row of a lamp in the table of lamps; absent for a lamp that is white for certain.
SPECTRUM = "spectrum"
# Lamps are numbered from 0 to 7, then left-out lamps, then the other lamps.
_LAMPS_BEFORE = 8
# Shapes of area lamps that are not round.
_SQUARES = {"SQUARE", "RECTANGLE"}
# Values in place of a spot's outer and inner cosines for other lamps. They are outside the range of cosines, and the
# smooth step from the first to the second is 1 for all cosines.
_AREA_RIM, _ROUND_RIM, _NO_RIM = ("3", "2"), ("3", "2.5"), ("-3", "-2")


def property_name(index: int, what: str) -> str:
    """The name of a lamp's property. Indices from LAMPS_MAX on are of lamps that the artist leaves out.

    Saved .blend files contain these names, so they must not change."""
    if index >= LAMPS_MAX:
        number = index - LAMPS_MAX + _LAMPS_BEFORE
    else:
        number = index if index < _LAMPS_BEFORE else index + LEFT_OUT_MAX
    return f"ng_key_{number}_{what}"


class PackedLamp(NamedTuple):
    """A lamp as nodes read it from the scene's properties.

    place         unit vector to a sun; position of another lamp, m
    is_local      0 for a sun, 1 for others
    variance      of the lamp's disc along one axis: rad2 for a sun, m2 for others
    power         a sun's irradiance, W/m2; another lamp's radiant intensity along its axis, W/sr
    x_over_y      the lamp's x scale over its y scale; an area lamp's height over its width
    casts_shadow  1 if it casts shadows, else 0
    z, x          the lamp's axes, each over its squared length; an area lamp's x reaches from its centre to its edge
    rim_outer     cosine at which the light begins, for a smooth step that is 1 for all lamps except spots
    rim_inner     cosine from which the light has full brightness
    is_spot       1 for a spot, else 0
    is_area       1 for an area lamp, else 0"""

    place: Value
    is_local: Value
    variance: Value
    power: Value
    x_over_y: Value
    casts_shadow: Value
    z: Value
    x: Value
    rim_outer: Value
    rim_inner: Value
    is_spot: Value
    is_area: Value


def unpack(tree: Tree, packed: Sequence[Value]) -> PackedLamp:
    """Unpack a lamp by nodes, from the vector and the fourth number of each property."""
    place, disc, power, scales, z, rim_outer, x, rim_inner = packed
    is_local = tree.math("GREATER_THAN", disc, -0.5)
    return PackedLamp(
        place=place,
        is_local=is_local,
        # |v + 0|, and for a sun |-1 - v + 1|.
        variance=tree.math("ABSOLUTE", disc + (1.0 - is_local)),
        power=power,
        x_over_y=tree.math("ABSOLUTE", scales),
        casts_shadow=tree.math("GREATER_THAN", scales, 0.0),
        z=z,
        x=x,
        rim_outer=rim_outer,
        rim_inner=rim_inner,
        is_spot=tree.math("LESS_THAN", tree.math("ABSOLUTE", rim_outer), 1.5),
        is_area=tree.math("GREATER_THAN", rim_outer, 1.5),
    )


def drive_properties(drivers: Drivers, index: int, lamp: bpy.types.Object) -> bool:
    """Create the properties of a lamp and the drivers that write them. Return whether anything changed.

    All drivers read the lamp's data through its object, so the data may be exchanged. They give 0 without the lamp."""
    data = lamp.data
    axes = {f"{name}{i}": f"matrix_world[{axis}][{i}]" for axis, name in enumerate("xyz") for i in range(3)}
    position = {name: f"matrix_world[3][{i}]" for i, name in enumerate("abc")}
    light = {"energy": "energy", "exposure": "exposure", "heated": "use_temperature", "normalized": "normalize"}
    light |= {"temperature": "temperature"}
    light |= {f"c{i}": f"color[{i}]" for i in range(3)} | {f"t{i}": f"temperature_color[{i}]" for i in range(3)}
    light |= _size_variables(data) | {"shadow": "use_shadow", "cone": "spot_size", "blend": "spot_blend"}
    paths = axes | position | {name: f"data.{path}" for name, path in light.items()}
    variables = [Variable(name, lamp, path) for name, path in paths.items()]
    variables.append(Variable("on", drivers.holder, f'["{property_name(index, ON)}"][0]'))
    variance = _variance(data)
    # A lamp shines along its own -Z, so the direction to a sun is +Z.
    is_sun = data.type == "SUN"
    place = [f"z{i} / max({_length('z')}, 1e-30)" for i in range(3)] if is_sun else "abc"
    strength = f"on * energy * pow(2, exposure) * {_per_watt(data)}"
    power = (f"{strength} * c{i} * (t{i} if heated else 1)" for i in range(3))
    outer, inner = _NO_RIM
    if data.type == "AREA":
        outer, inner = _AREA_RIM if data.shape in _SQUARES else _ROUND_RIM
    if data.type == "SPOT":
        outer = "cos(cone / 2)"
        # A blend of 0 gives a sharp rim. It gets the smallest width that single precision resolves.
        inner = f"{outer} + max((1 - {outer}) * blend, 1e-5)"
    driven: dict[str, tuple[str, ...]] = {
        "place": (*place, f"-1 - {variance}" if is_sun else variance),
        "power": (*power, f"{_x_over_y(data)} * (2 * shadow - 1)"),
        "z": (*(f"z{i} / max(pow({_length('z')}, 2), 1e-30)" for i in range(3)), outer),
        "x": (*(f"x{i} * {_x_factor(data)}" for i in range(3)), inner),
    }
    changed = drive_on(drivers, index, lamp, name=property_name(index, ON))
    if is_coloured(data):
        driven[SPECTRUM] = (row_expression(data),)
    else:
        changed |= drivers.remove(property_name(index, SPECTRUM))
    for what, expressions in driven.items():
        changed |= drivers.drive(property_name(index, what), expressions, variables)
    return changed


def _x_over_y(lamp: bpy.types.Light) -> str:
    if lamp.type == "AREA":
        return f"{_side('y', _height(lamp))} / max({_side('x', 'width')}, 1e-9)"
    return f"{_length('x')} / max({_length('y')}, 1e-9)"


def _x_factor(lamp: bpy.types.Light) -> str:
    """An expression for the length of the property `x` over that of the lamp's x axis."""
    if lamp.type == "AREA":
        # A disc of radius r has the variance of a square with half sides of sqrt(3) / 2 r.
        return f"width * {0.5 if lamp.shape in _SQUARES else math.sqrt(3) / 4:.9f}"
    return f"1 / max(pow({_length('x')}, 2), 1e-30)"


def _per_watt(lamp: bpy.types.Light) -> str:
    """An expression for the factor from a lamp's strength to `power`.

    A point or spot lamp of P watts has a radiant intensity of P / (4 pi) W/sr, and an area lamp P / pi along its axis.
    A sun's strength is its irradiance. Without Normalize the strength is multiplied by the lamp's area: a sphere's for
    points and spots, the solid angle of the disc for a sun."""
    pi = f"{math.pi:.9f}"
    if lamp.type == "SUN":
        return f"(1 if normalized else {pi} * pow(sin(min(angle, {pi}) / 2), 2))"
    if lamp.type in {"POINT", "SPOT"}:
        return f"(1 / (4 * {pi}) if normalized else radius * radius)"
    share = "1" if lamp.shape in _SQUARES else f"{math.pi / 4:.9f}"
    return f"(1 if normalized else {share} * {_side('x', 'width')} * {_side('y', _height(lamp))}) / {pi}"


def _variance(lamp: bpy.types.Light) -> str:
    """An expression for the mean variance along one axis: r^2 / 4 for a disc of radius r, s^2 / 12 for a side s."""
    if lamp.type == "SUN":
        return "pow(sin(min(angle, 3.14159265) / 2), 2) / 4"
    if lamp.type in {"POINT", "SPOT"}:
        return "radius * radius / 4"
    squares = f"(pow({_side('x', 'width')}, 2) + pow({_side('y', _height(lamp))}, 2))"
    return f"{squares} / {24 if lamp.shape in {'SQUARE', 'RECTANGLE'} else 32}"


def _height(lamp: bpy.types.Light) -> str:
    return "height" if lamp.shape in {"RECTANGLE", "ELLIPSE"} else "width"


def _side(axis: str, length: str) -> str:
    return f"{length} * {_length(axis)}"


def _length(axis: str) -> str:
    return f"sqrt({axis}0 * {axis}0 + {axis}1 * {axis}1 + {axis}2 * {axis}2)"


def _size_variables(lamp: bpy.types.Light) -> dict[str, str]:
    if lamp.type == "SUN":
        return {"angle": "angle"}
    if lamp.type in {"POINT", "SPOT"}:
        return {"radius": "shadow_soft_size"}
    return {"width": "size", "height": "size_y"}
