# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties of the scene as nodes read them: drivers of the nodes copy the numbers.

The Attribute node (View Layer) reads such properties too. But EEVEE looks each one up in a loop of its own for every
pixel, and a compiler may take time that grows with the third power of the number of loops: minutes from a dozen on. A
number that a driver writes is a constant of the shader, and a change of it compiles nothing again.

The drivers have no expression, and no target but the scene that is being evaluated. So Blender evaluates them with
auto-run of scripts off, and a material that is appended to another file brings nothing else with it.
"""

from collections.abc import Mapping

import bpy

from ..nodes.builder import Tree, Value


def read_property(tree: Tree, name: str) -> tuple[Value, Value]:
    """Add nodes that hold a custom property of the scene: its first three numbers as a vector, and its fourth. They are
    0 where there is no such property."""
    vector = tree.node("ShaderNodeCombineXYZ", label=name)
    number = tree.node("ShaderNodeValue", label=name)
    for index, socket in enumerate((*vector.inputs, number.outputs[0])):
        _follow(socket, f'["{name}"][{index}]')
    return tree.value(vector.outputs[0]), tree.value(number.outputs[0])


def drive_by_scene(tree: Tree, expression: str, variables: Mapping[str, str], *, label: str) -> Value:
    """Add a node that holds a number which an expression makes of properties of the scene that is being evaluated, by
    their paths from it; 0 stands for a property that is absent. The expression is one of those that Blender evaluates
    without Python."""
    socket = tree.node("ShaderNodeValue", label=label).outputs[0]
    driver = _new_driver(socket, "SCRIPTED")
    driver.expression = expression
    for name, path in variables.items():
        _add_variable(driver, path, name)
    return tree.value(socket)


def _follow(socket: bpy.types.NodeSocket, path: str) -> None:
    """Drive a socket's value by a number of the scene that is being evaluated, else by 0."""
    _add_variable(_new_driver(socket, "SUM"), path)


def _new_driver(socket: bpy.types.NodeSocket, kind: str) -> bpy.types.Driver:
    curve = socket.driver_add("default_value")
    assert isinstance(curve, bpy.types.FCurve)  # of one number it is one
    curve.keyframe_points.clear()  # Blender 5.2 makes some, and rounds the driver's values to them
    curve.driver.type = kind  # type: ignore[assignment]  # the stubs list the names
    socket.default_value = 0.0
    return curve.driver


def _add_variable(driver: bpy.types.Driver, path: str, name: str = "value") -> None:
    variable = driver.variables.new()
    variable.type, variable.name = "CONTEXT_PROP", name
    target = variable.targets[0]
    target.context_property, target.data_path = "ACTIVE_SCENE", path
    target.use_fallback_value, target.fallback_value = True, 0.0
