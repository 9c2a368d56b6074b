# SPDX-License-Identifier: GPL-3.0-or-later
"""The Key Light node group: what the scene's i-th lamp sends to the shaded point, from key_lights.py's properties.

| output     | symbol | unit  | meaning |
|------------|--------|-------|---------|
| To Light   | wi     |       | unit vector to the lamp |
| Irradiance | E      | W/m2  | on a surface that faces the lamp, unshadowed |
| Variance   |        | rad2  | of the lamp's disc in the sky, along one axis |
| Distance   | d      | m     | to the lamp |
| Shadow     |        |       | 1 if the lamp casts shadows |

    sun:      wi = place,               E = power
    others:   wi = (place - P) / d,     E = power cone(wi) / d^2

One group serves every kind of lamp, so that a material need not change with it.
"""

import bpy

from ..nodes.arrange import arrange
from ..nodes.builder import Tree, Value
from ..nodes.interface import Socket, add_interface
from .link import UNLINKED
from .pack import property_name

_INDEX = "ng_key_light"


# Suns are as far as any scene reaches.
_FAR = 1e5


_OUTPUTS = (
    Socket("To Light", "Vector", "Unit vector to the lamp"),
    Socket("Irradiance", "Color", "On a surface that faces the lamp, W/m2"),
    Socket("Variance", "Float", "Of the lamp's disc in the sky, rad2"),
    Socket("Distance", "Float", "To the lamp, metres"),
    Socket("Shadow", "Float", "1 if the lamp casts shadows"),
)


def lamp_group(index: int, linked: bool) -> bpy.types.NodeTree:
    """The file's group of the scene's lamp `index`, made if need be; `linked`: with light linking's marks."""
    name = f"Diffraction Key Light {index}{' Linked' if linked else ''}"
    for group in bpy.data.node_groups:
        if group.get(_INDEX) == name and group.library is None:
            return group
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    group[_INDEX] = name
    add_interface(group, (), _OUTPUTS)
    tree = Tree(group)

    place, size = tree.attribute(property_name(index, "place"))
    power, scales = tree.attribute(property_name(index, "power"))
    position = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Position"])
    local = tree.math("GREATER_THAN", size, -0.5)
    # A sun's is kept as minus one minus it.
    variance = tree.math("ABSOLUTE", size + (1.0 - local))
    # A sun's place is a unit vector, its distance 1.
    away = place - position * local
    squared_distance = tree.maximum(tree.dot(away, away), 1e-18)
    distance = tree.sqrt(squared_distance)
    wi = tree.normalize(away)

    power = power * (_cone(tree, index, wi, tree.math("ABSOLUTE", scales)) / squared_distance)
    if linked:
        unlinked, _ = tree.attribute(property_name(index, UNLINKED), "OBJECT")
        power = power * (1.0 - tree.dot(unlinked, (1.0, 0.0, 0.0)))
    far = (1.0 - local).times_plus(_FAR, distance)
    shadow = tree.math("GREATER_THAN", scales, 0.0)
    output = tree.node("NodeGroupOutput")
    for socket, value in zip(output.inputs, (wi, power, variance / squared_distance, far, shadow), strict=False):
        tree.feed(socket, value)
    arrange(group)
    return group


def _cone(tree: Tree, index: int, wi: Value, x_over_y: Value) -> Value:
    """A spot's soft cone in the lamp's own space, an area lamp's cosine, 1 for others: Blender's own formulas."""
    z, rim_outer = tree.attribute(property_name(index, "z"))
    x, rim_inner = tree.attribute(property_name(index, "x"))
    axis = tree.normalize(z)
    y = tree.cross(axis, x) * x_over_y
    own_z = tree.dot(wi, z)
    own = tree.vector(tree.dot(wi, x), tree.dot(wi, y), own_z)
    along = own_z / tree.vector_math("LENGTH", own)
    rim = tree.node("ShaderNodeMapRange", along, rim_outer, rim_inner, interpolation_type="SMOOTHSTEP")
    # Beyond every cosine, for an area lamp, and then of no account here.
    not_area = tree.math("LESS_THAN", rim_outer, 1.5)
    return tree.value(rim.outputs["Result"]) * tree.maximum(tree.dot(wi, axis), not_area)
