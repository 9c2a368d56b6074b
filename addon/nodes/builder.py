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
        vectors = [o.is_vector if isinstance(o, Value) else isinstance(o, tuple) for o in operands]
        if operation == "MULTIPLY" and vectors in ([True, False], [False, True]):
            # Multiply would have Cycles make a vector of the number first.
            vector, factor = operands if vectors[0] else operands[::-1]
            node = self.node("ShaderNodeVectorMath", vector, operation="SCALE")
            self.feed(node.inputs["Scale"], factor)
            return self.value(node.outputs["Vector"])
        kind = "ShaderNodeVectorMath" if any(vectors) else "ShaderNodeMath"
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

    def minimum(self, a: Operand, b: Operand) -> Value:
        return self.math("MINIMUM", a, b)

    def squared(self, a: Value) -> Value:
        return a * a

    def fresnel(self, ior: Operand, normal: Value) -> Value:
        """Unpolarised reflectance of a dielectric towards the viewer, whichever side of the mesh shows: Blender's node
        takes the viewer behind the mesh for one inside the dielectric."""
        behind = self.value(self.node("ShaderNodeNewGeometry").outputs["Backfacing"])
        ior = self.math("POWER", ior, behind.times_plus(-2.0, 1.0))
        return self.value(self.node("ShaderNodeFresnel", ior, normal).outputs[0])

    def vector(self, x: Operand, y: Operand, z: Operand) -> Value:
        return self.value(self.node("ShaderNodeCombineXYZ", x, y, z).outputs[0])

    def clamp(self, a: Operand, low: Operand, high: Operand) -> Value:
        """Component by component, for vectors."""
        return self.vector_math("MINIMUM", self.vector_math("MAXIMUM", a, low), high)

    def mix(self, share: Operand, a: Value, b: Value) -> Value:
        """a + share (b - a)."""
        return (b - a).times_plus(share, a)

    def image(self, image: bpy.types.Image, at: Value, label: str = "") -> Value:
        """A clamped look-up of an image at a vector in its 0..1 coordinates, by a cubic B-spline: the one filter that
        is the same in Cycles and EEVEE at any footprint (EEVEE's linear one uses mip levels)."""
        settings = {"image": image, "interpolation": "Cubic", "extension": "EXTEND"}
        return self.value(self.node("ShaderNodeTexImage", at, label=label, **settings).outputs["Color"])

    def attribute(self, name: str, holder: str = "VIEW_LAYER") -> tuple[Value, Value]:
        """A custom property of the scene (or of the object: holder "OBJECT"): its first three numbers as a vector, and
        its fourth; 0 where there is none."""
        node = self.node("ShaderNodeAttribute", attribute_type=holder, attribute_name=name, label=name)
        return self.value(node.outputs["Vector"]), self.value(node.outputs["Alpha"])

    def group(self, group: bpy.types.NodeTree, label: str = "", **inputs: Operand) -> dict[str, Value]:
        """A node of a group, its inputs by their names (blanks as underscores; those that it has not are passed over);
        its outputs by theirs."""
        node = self.node("ShaderNodeGroup", node_tree=group, label=label)
        for name, value in inputs.items():
            socket = node.inputs.get(name.replace("_", " "))
            if socket is not None:
                self.feed(socket, value)
        return {socket.name: self.value(socket) for socket in node.outputs}

    def emission(self, radiance: Value, strength: Operand) -> Value:
        return self.value(self.node("ShaderNodeEmission", radiance, strength).outputs[0])

    def mix_shader(self, share: Operand, a: Value | None, b: Value | None) -> Value:
        """(1 - share) a + share b; None is black. Cycles evaluates nothing of a side whose share is 0."""
        node = self.node("ShaderNodeMixShader", share)
        for socket, shader in zip(node.inputs[1:], (a, b), strict=True):
            if shader is not None:
                self.feed(socket, shader)
        return self.value(node.outputs[0])

    def add_shader(self, a: Value | None, b: Value) -> Value:
        return b if a is None else self.value(self.node("ShaderNodeAddShader", a, b).outputs[0])
