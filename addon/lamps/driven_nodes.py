# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading scene properties in nodes: drivers copy the numbers into the nodes.

The Attribute node (View Layer) could read the properties too. But EEVEE searches for each property in a separate loop
in every pixel, and some compilers take time cubic in the number of loops: minutes from a dozen on. A driven number is a
constant of the shader, and changing it needs no recompilation.

The drivers need no Python, and their only target is the scene being evaluated. So they work with auto-run of scripts
off, and appending a material to another file brings nothing else along."""

from collections.abc import Mapping

import bpy

from ..nodes.builder import Tree, Value


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
