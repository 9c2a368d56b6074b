# SPDX-License-Identifier: GPL-3.0-or-later
"""Directions in tangent space as nodes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from ..nodes.builder import Tree, Value


@dataclass(frozen=True)
class Direction:
    """A unit vector in tangent space: its components along T, B and N. `made_of` is the vector, if there is one."""

    x: Value
    y: Value
    cosine: Value
    made_of: Value | None = None

    @cached_property
    def vector(self) -> Value:
        """The components as a vector."""
        return self.made_of or self.cosine.tree.vector(self.x, self.y, self.cosine)

    @classmethod
    def seen_in(cls, tree: Tree, direction: Value, frame: tuple[Value, Value, Value]) -> Direction:
        """A direction from world space, given the axes (T, B, N)."""
        return cls(*(tree.dot(direction, axis) for axis in frame))

    @classmethod
    def of(cls, tree: Tree, vector: Value) -> Direction:
        """A vector that is already in tangent space."""
        node = tree.node("ShaderNodeSeparateXYZ", vector)
        x, y, z = (tree.value(node.outputs[axis]) for axis in "XYZ")
        return cls(x, y, z, vector)
