# SPDX-License-Identifier: GPL-3.0-or-later
"""A small builder that lets a node tree read like its formula.

    u = dot(half, tangent)
    radiance = reflectance * (scattered + cosine * zero_order)

Each operation adds a node and returns a Value: a socket with arithmetic. Floats and vectors mix as they do in Blender's
own sockets (a float spreads over a vector's components).
"""

from __future__ import annotations

from dataclasses import dataclass

import bpy


@dataclass(frozen=True)
class Value:
    """A float, vector or colour in a tree under construction."""

    tree: Tree
    socket: bpy.types.NodeSocket

    @property
    def is_vector(self) -> bool:
        return self.socket.type in {"VECTOR", "RGBA"}

    def __add__(self, other: Operand) -> Value:
        return self.tree.arithmetic("ADD", self, other)

    def __radd__(self, other: Operand) -> Value:
        return self.tree.arithmetic("ADD", other, self)

    def __sub__(self, other: Operand) -> Value:
        return self.tree.arithmetic("SUBTRACT", self, other)

    def __rsub__(self, other: Operand) -> Value:
        return self.tree.arithmetic("SUBTRACT", other, self)

    def __mul__(self, other: Operand) -> Value:
        return self.tree.arithmetic("MULTIPLY", self, other)

    def __rmul__(self, other: Operand) -> Value:
        return self.tree.arithmetic("MULTIPLY", other, self)

    def __truediv__(self, other: Operand) -> Value:
        return self.tree.arithmetic("DIVIDE", self, other)

    def times_plus(self, factor: Operand, addend: Operand) -> Value:
        """self * factor + addend in one node."""
        return self.tree.arithmetic("MULTIPLY_ADD", self, factor, addend)


Operand = Value | float | tuple[float, float, float]


class Tree:
    """Adds nodes to a node tree."""

    def __init__(self, tree: bpy.types.NodeTree):
        self.tree = tree

    def node(self, kind: str, *inputs: Operand, label: str = "", **settings) -> bpy.types.Node:
        """A node of a type with its settings and its first inputs; the node itself."""
        node = self.tree.nodes.new(kind)
        node.label = label
        for name, value in settings.items():
            setattr(node, name, value)
        for socket, value in zip(node.inputs, inputs, strict=False):
            self.feed(socket, value)
        return node

    def feed(self, socket: bpy.types.NodeSocket, value: Operand) -> None:
        """Link or set an input socket."""
        if isinstance(value, Value):
            self.tree.links.new(value.socket, socket)
        elif isinstance(value, (int, float)) and socket.type in {"VECTOR", "RGBA"}:
            socket.default_value = [float(value)] * len(socket.default_value)
        else:
            socket.default_value = value

    def value(self, socket: bpy.types.NodeSocket) -> Value:
        return Value(self, socket)

    def arithmetic(self, operation: str, *operands: Operand) -> Value:
        vector = any(o.is_vector if isinstance(o, Value) else isinstance(o, tuple) for o in operands)
        kind = "ShaderNodeVectorMath" if vector else "ShaderNodeMath"
        return self.value(self.node(kind, *operands, operation=operation).outputs[0])

    def math(self, operation: str, *operands: Operand) -> Value:
        """A scalar function by the name of Blender's Math node."""
        return self.value(self.node("ShaderNodeMath", *operands, operation=operation).outputs[0])

    def vector_math(self, operation: str, *operands: Operand) -> Value:
        """A vector function by the name of Blender's Vector Math node."""
        node = self.node("ShaderNodeVectorMath", *operands, operation=operation)
        return self.value(node.outputs["Value" if operation in {"DOT_PRODUCT", "LENGTH"} else "Vector"])

    def dot(self, a: Operand, b: Operand) -> Value:
        return self.vector_math("DOT_PRODUCT", a, b)

    def cross(self, a: Operand, b: Operand) -> Value:
        return self.vector_math("CROSS_PRODUCT", a, b)

    def normalize(self, a: Operand) -> Value:
        return self.vector_math("NORMALIZE", a)

    def sqrt(self, a: Operand) -> Value:
        return self.math("SQRT", a)

    def maximum(self, a: Operand, b: Operand) -> Value:
        return self.math("MAXIMUM", a, b)

    def squared(self, a: Value) -> Value:
        return a * a

    def vector(self, x: Operand, y: Operand, z: Operand) -> Value:
        return self.value(self.node("ShaderNodeCombineXYZ", x, y, z).outputs[0])

    def image(self, image: bpy.types.Image, at: Value, label: str = "") -> Value:
        """A linear, clamped look-up of an image at a vector in its 0..1 coordinates."""
        settings = {"image": image, "interpolation": "Linear", "extension": "EXTEND"}
        return self.value(self.node("ShaderNodeTexImage", at, label=label, **settings).outputs["Color"])

    def attribute(self, name: str) -> Value:
        """A custom property of the scene (Attribute node, View Layer) as a vector."""
        node = self.node("ShaderNodeAttribute", attribute_type="VIEW_LAYER", attribute_name=name, label=name)
        return self.value(node.outputs["Vector"])
