# SPDX-License-Identifier: GPL-3.0-or-later
"""The light from the scene's lamps at the shaded point, as nodes: the Lamp group, the drivers that feed it, and random
points of wide area lamps.

The Lamp group has these outputs:

| output     | symbol | unit  | meaning |
|------------|--------|-------|---------|
| To Light   | wi     |       | unit vector to the lamp |
| Irradiance | E      | W/m2  | on a surface that faces the lamp, without shadows |
| Variance   |        | rad2  | of the lamp's disc as seen from the point, along one axis |
| Distance   | d      | m     | to the lamp |
| Shadow     |        |       | 1 if the lamp casts shadows |

    sun:      wi = place,               E = power
    others:   wi = (place - P) / d,     E = power cone(wi) / d^2

P is the shaded point. The inputs are the scene's four properties of the lamp (lamp_drivers.py). One group serves
lamps of all kinds: a material need not change when a lamp changes its kind, and more lamps need no new data-block,
which Blender's undo would lose if no undo step created it.

Drivers copy the scene's properties into the nodes. The Attribute node (View Layer) could read them too. But EEVEE
searches for each property in a separate loop in every pixel, and some compilers take time cubic in the number of loops:
minutes from a dozen on. A driven number is a constant of the shader, and changing it needs no recompilation. The
drivers need no Python, and their only target is the scene being evaluated. So they work with auto-run of scripts off,
and appending a material to another file brings nothing else along."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import bpy

from ..nodes.builder import Operand, Tree, Value, shared_group
from ..nodes.interface import Socket
from .lamp_drivers import PROPERTIES, SPECTRUM, PackedLamp, property_name, unpack
from .light_linking import read_unlinked


def read_property(tree: Tree, name: str) -> tuple[Value, Value]:
    """Add nodes that hold a custom property of the scene: its first three numbers as a vector, and its fourth, or 0."""
    vector = tree.node("ShaderNodeCombineXYZ", label=name)
    number = tree.node("ShaderNodeValue", label=name)
    for index, socket in enumerate((*vector.inputs, number.outputs[0])):
        _follow(socket, -1, f'["{name}"][{index}]')
    return tree.value(vector.outputs[0]), tree.value(number.outputs[0])


def read_number(tree: Tree, name: str) -> Value:
    """Add a node that holds the first number of a custom property of the scene."""
    socket = tree.node("ShaderNodeValue", label=name).outputs[0]
    _follow(socket, -1, f'["{name}"][0]')
    return tree.value(socket)


def feed_property(vector: bpy.types.NodeSocket, number: bpy.types.NodeSocket, name: str) -> None:
    """The same for two inputs of a node, without further nodes."""
    for index in range(3):
        _follow(vector, index, f'["{name}"][{index}]')
    _follow(number, -1, f'["{name}"][3]')


def drive_by_scene(tree: Tree, expression: str, variables: Mapping[str, str], *, label: str) -> Value:
    """Add a node that holds an expression of scene properties, given by their paths in the scene being evaluated. A
    missing property counts as 0. The expression must be one that Blender evaluates without Python."""
    socket = tree.node("ShaderNodeValue", label=label).outputs[0]
    driver = _new_driver(socket, -1, "SCRIPTED")
    driver.expression = expression
    for name, path in variables.items():
        _add_variable(driver, path, name)
    return tree.value(socket)


def _follow(socket: bpy.types.NodeSocket, index: int, path: str) -> None:
    """Drive a component of a socket's value (-1: a number) by a number of the scene being evaluated; 0 if it is
    missing."""
    _add_variable(_new_driver(socket, index, "SUM"), path)


def _new_driver(socket: bpy.types.NodeSocket, index: int, kind: str) -> bpy.types.Driver:
    curve = socket.driver_add("default_value", index)
    assert isinstance(curve, bpy.types.FCurve)  # for a single number it returns one curve
    curve.keyframe_points.clear()  # Blender 5.2 creates some and snaps the driver's value to them
    curve.driver.type = kind  # type: ignore[assignment]  # the stubs list the names
    if index < 0:
        socket.default_value = 0.0
    else:
        socket.default_value[index] = 0.0
    return curve.driver


def _add_variable(driver: bpy.types.Driver, path: str, name: str = "value") -> None:
    variable = driver.variables.new()
    variable.type, variable.name = "CONTEXT_PROP", name
    target = variable.targets[0]
    target.context_property, target.data_path = "ACTIVE_SCENE", path
    target.use_fallback_value, target.fallback_value = True, 0.0


_NAME = "Lamp Irradiance"
# The vector of each property, and its fourth number.
LAMP_INPUTS = tuple(
    Socket(name, kind, "A property of the scene")
    for what in PROPERTIES
    for name, kind in ((what, "Vector"), (f"{what} 4", "Float"))
)
# The distance to a sun, in metres: larger than any scene.
FAR = 1e5
_TO_LIGHT = Socket("To Light", "Vector", "Unit vector to the lamp")
_IRRADIANCE = Socket("Irradiance", "Color", "Light on a surface that faces the lamp, in W/m2")
_VARIANCE = Socket("Variance", "Float", "Spread of the lamp's disc in the sky, in rad2")
_DISTANCE = Socket("Distance", "Float", "Distance to the lamp, in metres")
_SHADOW = Socket("Shadow", "Float", "1 if the lamp casts shadows")
LAMP_OUTPUTS = (_TO_LIGHT, _IRRADIANCE, _VARIANCE, _DISTANCE, _SHADOW)


@dataclass(frozen=True)
class Light:
    """The light from a lamp at the shaded point: unit vector to the lamp, irradiance (W/m2) on a surface that faces it,
    variance (rad2) of its disc as seen from the point along one axis, distance (m), and 1 or 0 for shadows. `spectrum`
    is its row in the table of lamps; None for a lamp that is white for certain."""

    direction: Value
    irradiance: Value
    variance: Value
    distance: Operand
    casts_shadow: Value
    spectrum: Value | None = field(default=None, kw_only=True)


def light_of(tree: Tree, index: int, linked: bool, *, coloured: bool = False) -> Light:
    """Add nodes for the scene's lamp `index`. `linked`: apply light linking. `coloured`: it may be of another spectrum
    than white."""
    outputs = group_of_lamp(tree, lamp_group(), index)
    light = Light(*(outputs[socket.name] for socket in LAMP_OUTPUTS), spectrum=spectrum_of_lamp(tree, index, coloured))
    return replace(light, irradiance=light.irradiance * (1.0 - read_unlinked(tree, index))) if linked else light


def spectrum_of_lamp(tree: Tree, index: int, coloured: bool) -> Value | None:
    """Add a node for the row of the scene's lamp `index` in the table of lamps, if it may be `coloured`."""
    return read_number(tree, property_name(index, SPECTRUM)) if coloured else None


def group_of_lamp(tree: Tree, group: bpy.types.NodeTree, index: int) -> dict[str, Value]:
    """Add a node of a group whose inputs LAMP_INPUTS follow the scene's lamp `index`. Return its outputs by name."""
    outputs = tree.group(group, label=f"Lamp {index}")
    inputs = outputs[_TO_LIGHT.name].socket.node.inputs
    for what in PROPERTIES:
        feed_property(inputs[what], inputs[f"{what} 4"], property_name(index, what))
    return outputs


def packed_lamp(tree: Tree, index: int, linked: bool) -> list[Operand]:
    """Add nodes that hold the scene's lamp `index` as it is packed (lamp_drivers.py): the vector and the fourth number
    of each property. `linked`: apply light linking."""
    packed: list[Operand] = []
    for what in PROPERTIES:
        vector, number = read_property(tree, property_name(index, what))
        if linked and what == "power":
            vector = vector * (1.0 - read_unlinked(tree, index))
        packed += vector, number
    return packed


def light_of_object(tree: Tree, *, coloured: bool) -> Light:
    """Add nodes for the lamp whose properties the object itself holds, as its lamp 0 (lamp_drivers.py). `coloured`:
    it may be of another spectrum than white."""
    packed = [value for what in PROPERTIES for value in tree.attribute(property_name(0, what), "OBJECT")]
    light = light_from(tree, packed, label="Lamp")
    if not coloured:
        return light
    row, _ = tree.attribute(property_name(0, SPECTRUM), "OBJECT")
    # A single number is a grey colour.
    return replace(light, spectrum=tree.dot(row, (1.0, 0.0, 0.0)))


def light_from(tree: Tree, packed: Sequence[Operand], *, label: str) -> Light:
    """Add nodes for a packed lamp (lamp_drivers.py): the vector and the fourth number of each property."""
    given = {socket.name: value for socket, value in zip(LAMP_INPUTS, packed, strict=True)}
    outputs = tree.group(lamp_group(), given, label=label)
    return Light(*(outputs[socket.name] for socket in LAMP_OUTPUTS))


def lamp_group() -> bpy.types.NodeTree:
    """The file's Lamp group, created if needed."""
    return shared_group(_NAME, LAMP_INPUTS, LAMP_OUTPUTS, build=_add_lamp)


def _add_lamp(tree: Tree) -> None:
    lamp = unpack(tree, list(tree.inputs().values()))
    position = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Position"])
    # For a sun, place is a unit vector, so the distance is 1.
    away = lamp.place - position * lamp.is_local
    squared_distance = tree.maximum(tree.dot(away, away), 1e-18)
    distance = tree.sqrt(squared_distance)
    wi = tree.normalize(away)
    irradiance = lamp.power * (_cone(tree, lamp, wi) / squared_distance)
    far = (1.0 - lamp.is_local).times_plus(FAR, distance)
    tree.output(wi, irradiance, lamp.variance / squared_distance, far, lamp.casts_shadow)


def _cone(tree: Tree, lamp: PackedLamp, wi: Value) -> Value:
    """The angular falloff by Blender's formulas: a soft cone for a spot, a cosine for an area lamp, 1 for others.

    The products with 0 make it a constant in Cycles for a sun and for a point lamp."""
    axis = tree.normalize(lamp.z)
    y = tree.cross(axis, lamp.x) * lamp.x_over_y
    own_z = tree.dot(wi, lamp.z)
    own = tree.vector(tree.dot(wi, lamp.x), tree.dot(wi, y), own_z)
    along = own_z / tree.vector_math("LENGTH", own)
    rim = tree.node("ShaderNodeMapRange", along, lamp.rim_outer, lamp.rim_inner, interpolation_type="SMOOTHSTEP")
    of_spot = (tree.value(rim.outputs["Result"]) - 1.0) * lamp.is_spot + 1.0
    of_area = (tree.maximum(tree.dot(wi, axis), 0.0) - 1.0) * lamp.is_area + 1.0
    return of_spot * of_area


# The table shows each light as a round Gaussian, and the light of a wide lamp has the lamp's own shape. So each sample
# takes a random point of the lamp, and leaves only a small variance to the table. The points fill a rectangle that is a
# little smaller than the lamp, so that points and Gaussian together have the lamp's variance. A round lamp gets the
# rectangle with its variances. Lamps of other kinds, and small area lamps, stay Gaussians, which have no noise.
# Closures, which must not see what the table shows, get the whole lamp.
# The variance in rad2 that is left to the table: that of a disc with a radius of 3 degrees. A larger one shows colours
# that are too pale, a smaller one is noisier.
LEFT = 0.0007
_AREA_NAME = "Lamp and Point"
_SEED = Socket("Seed", "Float", "Distinguishes the lamps' random points")
SHAPE = (
    Socket("Is Area", "Float", "1 for an area lamp, else 0"),
    Socket("Is Round", "Float", "1 for a round area lamp, else 0"),
    Socket("Away", "Vector", "To the lamp's centre, in metres"),
    Socket("Z", "Vector", "The lamp's z axis"),
    Socket("X", "Vector", "From an area lamp's centre to its edge, in metres"),
    Socket("Y", "Vector", "The same along the other side"),
)
_POINT = tuple(socket._replace(name=f"Point {socket.name}") for socket in LAMP_OUTPUTS)


@dataclass(frozen=True)
class WholeLamp(Light):
    """A lamp at the shaded point, with its shape if it is an area lamp.

    is_area, is_round  1 for an area lamp, and for a round one; else 0
    away               to the lamp's centre
    axes               an area lamp's z; x and y from its centre to its edges, or of a round lamp to those of the
                       rectangle with its variances"""

    is_area: Value
    is_round: Value
    away: Value
    axes: tuple[Value, Value, Value]

    def is_met(self, direction: Value) -> Value:
        """1 if a ray in a direction (a unit vector) meets an area lamp, else 0."""
        tree = direction.tree
        z, x, y = self.axes
        along = tree.math("DIVIDE", tree.dot(self.away, z), tree.dot(direction, z))
        beside = direction * along - self.away
        a, b = (tree.math("DIVIDE", tree.dot(beside, axis), tree.dot(axis, axis)) for axis in (x, y))
        a2, b2 = tree.squared(a), tree.squared(b)
        square = tree.maximum(a2, b2)
        # A disc of radius r has the variance of a square with half sides of sqrt(3) / 2 r.
        least = ((a2 + b2) * 0.75 - square).times_plus(self.is_round, square)
        return tree.math("LESS_THAN", least, 1.0) * tree.math("GREATER_THAN", along, 0.0)


def lamp_and_point(tree: Tree, packed: Sequence[Operand], *, seed: Operand, label: str) -> tuple[WholeLamp, Light]:
    """Add nodes for a packed lamp (lamp_drivers.py): the whole lamp, and the light that a sample takes from it."""
    given = {socket.name: value for socket, value in zip((*LAMP_INPUTS, _SEED), (*packed, seed), strict=True)}
    outputs = tree.group(lamp_and_point_group(), given, label=label)
    light, point = (Light(*(outputs[socket.name] for socket in sockets)) for sockets in (LAMP_OUTPUTS, _POINT))
    is_area, is_round, away, *axes = (outputs[socket.name] for socket in SHAPE)
    held = light.direction, light.irradiance, light.variance, light.distance, light.casts_shadow
    return WholeLamp(*held, is_area, is_round, away, (axes[0], axes[1], axes[2])), point


def lamp_and_point_group() -> bpy.types.NodeTree:
    """The file's group of a whole lamp and a point of it, created if needed."""
    return shared_group(_AREA_NAME, (*LAMP_INPUTS, _SEED), (*LAMP_OUTPUTS, *_POINT, *SHAPE), build=_add_both)


def _add_both(tree: Tree) -> None:
    """The nodes of the group."""
    *packed, seed = tree.inputs().values()
    place, disc, _, scales, z, rim, x, inner_rim = packed
    light = light_from(tree, packed, label="Lamp")
    is_area = tree.math("GREATER_THAN", rim, 1.5)
    is_round = tree.math("GREATER_THAN", inner_rim, 2.25) * is_area
    position = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Position"])
    y = tree.cross(tree.normalize(z), x) * tree.math("ABSOLUTE", scales)
    away = place - position
    left = tree.minimum(tree.dot(away, away) * LEFT, disc)
    size = tree.sqrt(tree.maximum(1.0 - tree.math("DIVIDE", left, disc), 0.0)) * is_area
    noise = tree.node("ShaderNodeTexWhiteNoise", position, seed, noise_dimensions="4D")
    split = tree.node("ShaderNodeSeparateXYZ", tree.value(noise.outputs["Color"]))
    a, b = (tree.value(split.outputs[axis]).times_plus(2.0, -1.0) * size for axis in "XY")
    # For a lamp of another kind, Cycles removes all that is multiplied by 0, and both lights are the same nodes.
    offset = tree.vector_math("SCALE", x, a) + tree.vector_math("SCALE", y, b)
    packed[:2] = place + offset, (left - disc) * is_area + disc
    point = light_from(tree, packed, label="Point")
    both = (light.direction, light.irradiance, light.variance, light.distance, light.casts_shadow), (
        point.direction, point.irradiance, point.variance, point.distance, point.casts_shadow,
    )  # fmt: skip
    tree.output(*both[0], *both[1], is_area, is_round, away, z, x, y)
