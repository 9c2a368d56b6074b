# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene's lamps as properties of the scene, kept by drivers.

Materials read them with the Attribute node (View Layer). The drivers are simple expressions: Blender evaluates them
with auto-run of scripts off and without this extension, so whatever is done to a lamp is followed, and a material that
is appended to another scene follows that scene's lamps.

`ng_key_<i>_` and its three numbers, then a fourth:

    place   unit vector to a sun; position of another lamp, m
            mean variance of its disc along one axis, m2; for a sun minus one minus that, rad2
    power   linear RGB: a sun's irradiance, W/m2; another's radiant intensity along its axis, W/sr
            its own x over its y scale; negative if it casts no shadow
    z       its axis z over its squared length
            cosine of the angle off its axis from which a spot begins to shine; 3 for an area lamp, -3 for others
    x       its axis x over its squared length
            cosine of the angle within which it shines in full; 2 for an area lamp, -2 for others: all round

Four properties, and not more: EEVEE looks each up in a loop of its own for every pixel, and the software rasteriser's
compiler takes minutes over twenty such loops.
"""

import math
import re
from collections.abc import Iterator

import bpy

PROPERTIES = ("place", "power", "z", "x")


def property_name(index: int, what: str) -> str:
    return f"ng_key_{index}_{what}"


def drive_properties(scene: bpy.types.Scene, index: int, lamp: bpy.types.Object) -> None:
    kind, data = lamp.data.type, lamp.data
    axes = {f"{name}{i}": f"matrix_world[{axis}][{i}]" for axis, name in enumerate("xyz") for i in range(3)}
    shown, holders = _visibility(scene, lamp)
    size = _size_variables(data)
    light = {"energy": "energy", "exposure": "exposure", "heated": "use_temperature", "normalized": "normalize"}
    light |= {f"c{i}": f"color[{i}]" for i in range(3)} | {f"t{i}": f"temperature_color[{i}]" for i in range(3)}
    light |= size | {"shadow": "use_shadow"}
    variance = _variance(data)
    # A lamp shines along its own -Z: a sun lies along +Z.
    place = [f"z{i} / max({_length('z')}, 1e-30)" for i in range(3)] if kind == "SUN" else "abc"
    position = {name: f"matrix_world[3][{i}]" for i, name in enumerate("abc")}
    strength = f"{shown} * energy * pow(2, exposure) * {_per_watt(data)}"
    power = (f"{strength} * c{i} * (t{i} if heated else 1)" for i in range(3))
    outer, inner = {"AREA": ("3", "2")}.get(kind, ("-3", "-2"))
    if kind == "SPOT":
        outer = "cos(cone / 2)"
        # At blend 0 the rim is sharp: a width that single precision still tells from none.
        inner = f"{outer} + max((1 - {outer}) * blend, 1e-5)"
    cone = {"cone": "spot_size", "blend": "spot_blend"} if kind == "SPOT" else {}
    drive = _Drive(scene, index, lamp)
    drive("place", (*place, f"-1 - {variance}" if kind == "SUN" else variance), axes | position, size)
    drive("power", (*power, f"{_length('x')} / max({_length('y')}, 1e-9) * (2 * shadow - 1)"),
          {"hidden": "hide_render"} | axes, light, holders)  # fmt: skip
    drive("z", (*(f"z{i} / max(pow({_length('z')}, 2), 1e-30)" for i in range(3)), outer), axes, cone)
    drive("x", (*(f"x{i} / max(pow({_length('x')}, 2), 1e-30)" for i in range(3)), inner), axes, cone)


class _Drive:
    """Makes a property of the scene and drives it by what a lamp's object and its data hold."""

    def __init__(self, scene: bpy.types.Scene, index: int, lamp: bpy.types.Object):
        self.scene, self.index, self.lamp = scene, index, lamp

    def __call__(self, what: str, expressions, of_object: dict[str, str], of_data: dict[str, str], others=()) -> None:
        name = property_name(self.index, what)
        self.scene[name] = [0.0] * 4
        variables = [(key, "OBJECT", self.lamp, path) for key, path in of_object.items()]
        variables += [(key, "LIGHT", self.lamp.data, path) for key, path in of_data.items()]
        for i, expression in enumerate(expressions):
            driver = self.scene.driver_add(f'["{name}"]', i).driver
            driver.type = "SCRIPTED"
            words = set(re.findall(r"[a-z_]+[0-9]*", expression))
            for variable in (*variables, *others):
                if variable[0] in words:
                    _add_variable(driver, *variable)
            driver.expression = _compact(expression)


def _visibility(scene: bpy.types.Scene, lamp: bpy.types.Object) -> tuple[str, list]:
    """Expression for 1 where the render shows the lamp, else 0, and the variables of the collections that it is in:
    it is shown if it is not hidden and all collections down one way to it are not."""
    holders: dict[bpy.types.Collection, str] = {}
    ways = []
    for way in _ways(scene.collection, lamp):
        for collection in way:
            holders.setdefault(collection, f"h{len(holders)}")
        ways.append(" * ".join(f"(1 - {holders[collection]})" for collection in way) or "1")
    variables = [(name, "COLLECTION", collection, "hide_render") for collection, name in holders.items()]
    anyone = ways[0] if len(ways) == 1 else f"max({', '.join(ways)})"
    return f"(1 - hidden) * {anyone}", variables


def _ways(
    collection: bpy.types.Collection, lamp: bpy.types.Object, above: tuple[bpy.types.Collection, ...] = ()
) -> Iterator[tuple[bpy.types.Collection, ...]]:
    """The chains of collections under the scene's own that lead to a lamp."""
    if lamp.name in collection.objects and collection.objects[lamp.name] == lamp:
        yield above
    for child in collection.children:
        yield from _ways(child, lamp, (*above, child))


def _per_watt(lamp: bpy.types.Light) -> str:
    """What a lamp's strength is multiplied by to give `power`. Blender's point and spot lamps of P watts have a
    radiant intensity of P / (4 pi) W/sr, its area lamps P / pi along their axis, a sun's strength is its irradiance; a
    lamp that is not normalized has so much for each unit of its area (a point: of its sphere's; a sun: of its disc's
    solid angle)."""
    pi = f"{math.pi:.9f}"
    if lamp.type == "SUN":
        return f"(1 if normalized else {pi} * pow(sin(min(angle, {pi}) / 2), 2))"
    if lamp.type in {"POINT", "SPOT"}:
        return f"(1 / (4 * {pi}) if normalized else radius * radius)"
    share = "1" if lamp.shape in {"SQUARE", "RECTANGLE"} else f"{math.pi / 4:.9f}"
    return f"(1 if normalized else {share} * {_side('x', 'width')} * {_side('y', _height(lamp))}) / {pi}"


def _variance(lamp: bpy.types.Light) -> str:
    """Expression for the mean variance along one axis: a disc of radius r has r^2 / 4, a side s has s^2 / 12."""
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


def _compact(expression: str) -> str:
    """Without the blanks about operators: a driver's expression ends at 255 characters."""
    return re.sub(r" ?([-+*/,]) ?", r"\1", expression)


def _add_variable(driver: bpy.types.Driver, name: str, kind: str, holder: bpy.types.ID, path: str) -> None:
    variable = driver.variables.new()
    variable.name = name
    variable.targets[0].id_type = kind
    variable.targets[0].id = holder
    variable.targets[0].data_path = path
