# SPDX-License-Identifier: GPL-3.0-or-later
"""A small builder that lets a node tree read like its formula.

    u = dot(half, tangent)
    radiance = reflectance * (scattered + cosine * zero_order)

Each operation adds a node and returns a Value: a socket with arithmetic. Floats and vectors mix as in Blender's own
sockets (a float spreads over a vector's components).

A call that does not fit its node raises TypeError, like a wrong call of a Python function: an unknown input of a group,
too many inputs, or an unknown setting. The message names the node.

Blender takes time in proportion to the square of a group's nodes to make them. So what each lamp needs is a group of
its own, and so is a formula of many nodes: a file has these groups once, for all of its materials."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import bpy

from ..blender import stored
from .interface import LOOP, LOOP_END, Socket, add_interface, arrange, has_sockets, lost_in, note_parts


@dataclass(frozen=True)
class Value:
    """A float, vector or colour in a tree under construction."""

    tree: Tree
    socket: bpy.types.NodeSocket

    @property
    def is_vector(self) -> bool:
        """Whether it has three components (a vector or a colour)."""
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

    def __rtruediv__(self, other: Operand) -> Value:
        return self.tree.arithmetic("DIVIDE", other, self)

    def times_plus(self, factor: Operand, addend: Operand) -> Value:
        """self * factor + addend in one node."""
        return self.tree.arithmetic("MULTIPLY_ADD", self, factor, addend)


Operand = Value | float | tuple[float, float, float]


def _is_vector(operand: Operand) -> bool:
    """Whether it has three components."""
    return operand.is_vector if isinstance(operand, Value) else isinstance(operand, tuple)


class Tree:
    """Adds nodes to a node tree."""

    def __init__(self, tree: bpy.types.NodeTree):
        self.tree = tree

    def node(self, kind: str, *inputs: Operand, label: str = "", **settings: object) -> bpy.types.Node:
        """Add a node of the Blender type `kind`, with its settings and the values of its first inputs.

        Raises TypeError for an unknown setting, and for more values than enabled inputs."""
        node = self.tree.nodes.new(kind)
        if label:
            node.label = label
        for name, value in settings.items():
            if name not in node.bl_rna.properties:
                raise TypeError(f"{_described(node)}: it has no setting {name!r}")
            setattr(node, name, value)
        if hasattr(node, "texture_mapping"):
            # Blender detects an identity mapping only after the mapping was set. Otherwise EEVEE multiplies by a
            # matrix, which takes 96 bytes of the 64 KiB for a material's constants.
            node.texture_mapping.scale = (1.0, 1.0, 1.0)
        sockets = [socket for socket in node.inputs if socket.enabled]
        if len(inputs) > len(sockets):
            raise TypeError(f"{_described(node)}: {len(inputs)} inputs for the sockets {_names(sockets)}")
        for socket, value in zip(sockets, inputs, strict=False):
            self.feed(socket, value)
        return node

    def inputs(self) -> dict[str, Value]:
        """The inputs of the group under construction, by name."""
        return self.outputs_of(self.node("NodeGroupInput"))

    def output(self, *values: Operand) -> None:
        """Set the outputs of the group under construction, in their order.

        Raises TypeError unless there is one value for each output."""
        node = self.node("NodeGroupOutput")
        sockets = [socket for socket in node.inputs if socket.name]
        if len(values) != len(sockets):
            raise TypeError(f"{_described(node)}: {len(values)} values for the sockets {_names(sockets)}")
        for socket, value in zip(sockets, values, strict=True):
            self.feed(socket, value)

    def outputs_of(self, node: bpy.types.Node) -> dict[str, Value]:
        """The outputs of a node, by name."""
        return {socket.name: self.value(socket) for socket in node.outputs if socket.name}

    def feed(self, socket: bpy.types.NodeSocket, value: Operand | tuple[float, float, float, float]) -> None:
        """Link an input socket to a value, or set its default."""
        if isinstance(value, Value):
            self.tree.links.new(value.socket, socket)
            return
        held = socket.default_value
        wanted: object = value
        if isinstance(value, (int, float)) and socket.type in {"VECTOR", "RGBA"}:
            wanted = (float(value),) * len(held)
        elif isinstance(value, tuple) and socket.type == "RGBA":
            wanted = (*value, 1.0)[: len(held)]
        # Blender goes through the whole tree at each change.
        if (tuple(held) if isinstance(wanted, tuple) else held) != wanted:
            socket.default_value = wanted

    def value(self, socket: bpy.types.NodeSocket) -> Value:
        """The value of an output socket."""
        return Value(self, socket)

    def arithmetic(self, operation: str, *operands: Operand) -> Value:
        """An operation that Blender's Math and Vector Math nodes share, by name; a vector if any operand is one."""
        vectors = [_is_vector(operand) for operand in operands]
        if operation == "MULTIPLY" and any(vectors):
            # A mix with 0. Cycles evaluates it in less than half the time of Vector Math.
            vector, factor = operands if vectors[0] else operands[::-1]
            return self.blend(factor, (0.0, 0.0, 0.0), vector)
        kind = "ShaderNodeVectorMath" if any(vectors) else "ShaderNodeMath"
        return self.value(self.node(kind, *operands, operation=operation).outputs[0])

    def math(self, operation: str, *operands: Operand) -> Value:
        """A scalar function, by its name in Blender's Math node."""
        return self.value(self.node("ShaderNodeMath", *operands, operation=operation).outputs[0])

    def vector_math(self, operation: str, *operands: Operand) -> Value:
        """A vector function, by its name in Blender's Vector Math node."""
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
        """a times a."""
        return a * a

    def sum_of_squares(self, first: Value, *others: Value) -> Value:
        """The sum of the squares of numbers. Cycles evaluates it in less time than a dot product."""
        total = self.squared(first)
        for each in others:
            total = each.times_plus(each, total)
        return total

    def fresnel(self, ior: Operand, normal: Value) -> Value:
        """Unpolarised reflectance of a dielectric towards the viewer, equal on both sides of the mesh.

        Blender's Fresnel node would treat a viewer behind the mesh as inside the dielectric."""
        behind = self.value(self.node("ShaderNodeNewGeometry").outputs["Backfacing"])
        ior = self.math("POWER", ior, behind.times_plus(-2.0, 1.0))
        return self.value(self.node("ShaderNodeFresnel", ior, normal).outputs[0])

    def vector(self, x: Operand, y: Operand, z: Operand) -> Value:
        """A vector of three numbers."""
        return self.value(self.node("ShaderNodeCombineXYZ", x, y, z).outputs[0])

    def from_object(self, direction: Operand) -> Value:
        """A direction, converted from object space to world space."""
        settings = {"vector_type": "VECTOR", "convert_from": "OBJECT", "convert_to": "WORLD"}
        return self.value(self.node("ShaderNodeVectorTransform", direction, **settings).outputs["Vector"])

    def to_camera(self, normal: Value, space: str) -> Value:
        """A normal in a space (WORLD or OBJECT), converted to the camera's."""
        settings = {"vector_type": "NORMAL", "convert_from": space, "convert_to": "CAMERA"}
        return self.value(self.node("ShaderNodeVectorTransform", normal, **settings).outputs["Vector"])

    def mix(self, share: Operand, a: Value, b: Value) -> Value:
        """a + share (b - a)."""
        return (b - a).times_plus(share, a)

    def blend(self, share: Operand, a: Operand, b: Operand) -> Value:
        """The same for vectors, by Blender's Mix node. A number counts as a vector of equal components. `share` may be
        a vector, with a share for each component.

        Cycles evaluates it in less than half the time of Vector Math nodes."""
        mode = "NON_UNIFORM" if _is_vector(share) else "UNIFORM"
        return self._mixed(share, a, b, data_type="VECTOR", factor_mode=mode)

    def _mixed(self, share: Operand, a: Operand, b: Operand, **settings: str) -> Value:
        node = self.node("ShaderNodeMix", share, a, b, clamp_factor=False, **settings)
        return self.value(next(socket for socket in node.outputs if socket.enabled))

    def in_cycles(self) -> Value:
        """1 in Cycles and 0 in EEVEE.

        Cycles has no UV Along Stroke, so there a socket that reads it keeps its own value, and what a choice by it
        leaves out costs nothing. EEVEE reads 0."""
        node = self.node("ShaderNodeMath", 0.0, 1.0, operation="ADD")
        self.feed(node.inputs[1], self.value(self.node("ShaderNodeUVAlongStroke").outputs["UV"]))
        return self.value(node.outputs[0])

    def choice(self, share: Operand, a: Operand, b: Operand) -> Value:
        """Of numbers: a where the share is 0, b where it is 1. Cycles leaves out what a known share does not need."""
        return self._mixed(share, a, b, data_type="FLOAT")

    def for_each(
        self, items: Sequence[Sequence[Operand]], begin: Sequence[Operand],
        body: Callable[[Sequence[Operand], Sequence[Value]], Sequence[Value]],
    ) -> Sequence[Value]:  # fmt: skip
        """Add a loop of the nodes of body(item, state), for each item in turn. The state is what the turn before
        returned, first `begin`. Return the last state. All items have values of the same kinds."""
        first, last = self.node(LOOP), self.node(LOOP_END)
        first.pair_with_output(last)
        last.repeat_items.clear()
        for index, value in enumerate(begin):
            last.repeat_items.new("VECTOR" if _is_vector(value) else "FLOAT", f"{index}")
        turns, *starts = (socket for socket in first.inputs if socket.name)
        turns.default_value = len(items)
        for socket, value in zip(starts, begin, strict=True):
            self.feed(socket, value)
        turn, *state = self.outputs_of(first).values()
        reached = [self.math("GREATER_THAN", turn, index - 0.5) for index in range(1, len(items))]
        made = body([self._value_at(reached, values) for values in zip(*items, strict=True)], state)
        for socket, value in zip((socket for socket in last.inputs if socket.name), made, strict=True):
            self.feed(socket, value)
        return list(self.outputs_of(last).values())

    def _value_at(self, reached: Sequence[Value], values: Sequence[Operand]) -> Operand:
        """The last of the values that is reached: each after the first has a number that is 1 from then on, else 0."""
        chosen, *others = values
        for share, value in zip(reached, others, strict=True):
            if value != chosen:
                # Cycles removes a mix of colours or of numbers whose share is known to be 0 or 1, but not of vectors.
                kind = "RGBA" if _is_vector(value) else "FLOAT"
                chosen = self._mixed(share, chosen, value, data_type=kind)
        return chosen

    def image(self, image: bpy.types.Image, at: Value, label: str = "") -> Value:
        """Look up an image at coordinates from 0 to 1, by a cubic B-spline. Outside the image, its edge continues.

        Only this filter is the same in Cycles and EEVEE at all pixel sizes: EEVEE's linear filter uses mip levels."""
        settings = {"image": image, "interpolation": "Cubic", "extension": "EXTEND"}
        return self.value(self.node("ShaderNodeTexImage", at, label=label, **settings).outputs["Color"])

    def attribute(self, name: str, holder: str = "VIEW_LAYER") -> tuple[Value, Value]:
        """Read a custom property of the scene, or with the holder "OBJECT" of the object: its first three numbers as a
        vector, and its fourth. Both are 0 if the property is missing."""
        node = self.node("ShaderNodeAttribute", attribute_type=holder, attribute_name=name, label=name)
        return self.value(node.outputs["Vector"]), self.value(node.outputs["Alpha"])

    def group(
        self, group: bpy.types.NodeTree, inputs: Mapping[str, Operand] | None = None, *, label: str = ""
    ) -> dict[str, Value]:
        """Add a node of a group, with inputs by name. Return its outputs. Raises TypeError for an unknown input."""
        node = self.node("ShaderNodeGroup", node_tree=group, label=label)
        node.width = group.default_group_node_width
        sockets = {socket.name: socket for socket in node.inputs}
        for name, value in (inputs or {}).items():
            if name not in sockets:
                raise TypeError(f"{_described(node)}: no input {name!r} among the sockets {_names(node.inputs)}")
            self.feed(sockets[name], value)
        return self.outputs_of(node)

    def emission(self, radiance: Value, strength: Operand) -> Value:
        """A shader that emits a radiance times a strength."""
        # An earlier Blender, which does not know a node before it, shows the colour of the socket itself.
        node = self.node("ShaderNodeEmission", (0.0, 0.0, 0.0), strength)
        self.feed(node.inputs["Color"], radiance)
        return self.value(node.outputs[0])

    def glossy(self, colour: Value, roughness: Operand, normal: Value) -> Value:
        """A glossy reflection around a normal, with a Beckmann distribution."""
        node = self.node("ShaderNodeBsdfAnisotropic", colour, roughness, distribution="BECKMANN")
        self.feed(node.inputs["Normal"], normal)
        return self.value(node.outputs[0])

    def mix_shader(self, share: Operand, a: Value | None, b: Value | None) -> Value:
        """(1 - share) a + share b, where None is black. Cycles skips a side with a weight of 0."""
        node = self.node("ShaderNodeMixShader", share)
        for socket, shader in zip(node.inputs[1:], (a, b), strict=True):
            if shader is not None:
                self.feed(socket, shader)
        return self.value(node.outputs[0])

    def add_shader(self, a: Value | None, b: Value) -> Value:
        """a + b, where None is black."""
        return b if a is None else self.value(self.node("ShaderNodeAddShader", a, b).outputs[0])


# Custom property that marks a shared group by its name, saved in files.
_SHARED = "ng_shared"


def shared_group(
    name: str, inputs: tuple[Socket, ...], outputs: tuple[Socket, ...], *, build: Callable[[Tree], None], of: str = ""
) -> bpy.types.NodeTree:
    """The file's group of a name, created if needed. `build` adds its nodes. `of` tells apart groups of one name whose
    nodes hold other constants."""
    mark = f"{name} {of}".strip()
    for group in bpy.data.node_groups:
        is_one = stored.text(group, _SHARED) == mark and group.library is None
        if is_one and has_sockets(group, inputs, outputs) and not lost_in(group):
            return group
    group = bpy.data.node_groups.new(name, "ShaderNodeTree")
    group[_SHARED] = mark
    add_interface(group, inputs, outputs)
    build(Tree(group))
    arrange(group)
    note_parts(group)
    return group


def by_group(
    tree: Tree, name: str, formula: Callable[..., tuple[Value, ...]], *, given: Mapping[str, Operand],
    gives: Mapping[str, str], of: str = "",
) -> tuple[Value, ...]:  # fmt: skip
    """Add a node of the file's group of a formula. The formula gets a Tree and the values of `given` by name, and
    returns the values `gives`, each of a kind of socket. `of` has the constants in it, if they may differ."""
    vectors = {name for name, value in given.items() if isinstance(value, Value) and value.is_vector}
    inputs = tuple(Socket(name, "Vector" if name in vectors else "Float", "") for name in given)
    outputs = tuple(Socket(each, kind, "") for each, kind in gives.items())

    def build(inner: Tree) -> None:
        inner.output(*formula(inner, **inner.inputs()))

    found = tree.group(shared_group(name, inputs, outputs, build=build, of=of), given)
    return tuple(found[each] for each in gives)


def _described(node: bpy.types.Node) -> str:
    """The node's type and, for a group node, the group's name."""
    group = getattr(node, "node_tree", None)
    return f"node {node.bl_idname}" if group is None else f"node {node.bl_idname} of {group.name!r}"


def _names(sockets: Iterable[bpy.types.NodeSocket]) -> str:
    return ", ".join(socket.name for socket in sockets) or "(none)"
