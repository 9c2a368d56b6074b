# SPDX-License-Identifier: GPL-3.0-or-later
"""The Lamp node group: the light from one of the scene's lamps at the shaded point.

| output     | symbol | unit  | meaning |
|------------|--------|-------|---------|
| To Light   | wi     |       | unit vector to the lamp |
| Irradiance | E      | W/m2  | on a surface that faces the lamp, without shadows |
| Variance   |        | rad2  | of the lamp's disc as seen from the point, along one axis |
| Distance   | d      | m     | to the lamp |
| Shadow     |        |       | 1 if the lamp casts shadows |

    sun:      wi = place,               E = power
    others:   wi = (place - P) / d,     E = power cone(wi) / d^2

P is the shaded point. The inputs are the scene's four properties of the lamp (lamp_properties.py). One group serves
lamps of all kinds: a material need not change when a lamp changes its kind, and more lamps need no new data-block,
which Blender's undo would lose if no undo step created it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import bpy

from ..blender import stored
from ..nodes.arrange import arrange
from ..nodes.builder import Operand, Tree, Value
from ..nodes.interface import Socket, add_interface, has_sockets
from ..nodes.node_count import has_parts, note_parts
from .driven_nodes import feed_property, read_number
from .lamp_properties import PROPERTIES, SPECTRUM, PackedLamp, property_name, unpack
from .light_linking import read_unlinked

# Custom property that marks the group, saved in files.
_LAMP = "ng_key_light"
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


def light_of_object(tree: Tree, *, coloured: bool) -> Light:
    """Add nodes for the lamp whose properties the object itself holds, as its lamp 0 (lamp_properties.py). `coloured`:
    it may be of another spectrum than white."""
    packed = [value for what in PROPERTIES for value in tree.attribute(property_name(0, what), "OBJECT")]
    light = light_from(tree, packed, label="Lamp")
    if not coloured:
        return light
    row, _ = tree.attribute(property_name(0, SPECTRUM), "OBJECT")
    # A single number is a grey colour.
    return replace(light, spectrum=tree.dot(row, (1.0, 0.0, 0.0)))


def light_from(tree: Tree, packed: Sequence[Operand], *, label: str) -> Light:
    """Add nodes for a packed lamp (lamp_properties.py): the vector and the fourth number of each property."""
    given = {socket.name: value for socket, value in zip(LAMP_INPUTS, packed, strict=True)}
    outputs = tree.group(lamp_group(), given, label=label)
    return Light(*(outputs[socket.name] for socket in LAMP_OUTPUTS))


def lamp_group() -> bpy.types.NodeTree:
    """The file's Lamp group, created if needed."""
    return shared_group(_NAME, LAMP_INPUTS, LAMP_OUTPUTS, build=_add_lamp)


def shared_group(
    name: str, inputs: tuple[Socket, ...], outputs: tuple[Socket, ...], *, build: Callable[[Tree], None]
) -> bpy.types.NodeTree:
    """The file's group of a name that all lamps share, created if needed. `build` adds its nodes.

    Blender takes time in proportion to the square of a group's nodes to make them, so what each lamp needs is a group
    of its own."""
    for group in bpy.data.node_groups:
        if stored.text(group, _LAMP) == name and group.library is None and _is_whole(group, inputs, outputs):
            return group
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    group[_LAMP] = name
    add_interface(group, inputs, outputs)
    build(Tree(group))
    arrange(group)
    note_parts(group)
    return group


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


def _is_whole(group: bpy.types.NodeTree, inputs: Sequence[Socket], outputs: Sequence[Socket]) -> bool:
    return has_sockets(group, inputs, outputs) and has_parts(group)


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
