# SPDX-License-Identifier: GPL-3.0-or-later
"""Directions in tangent space as nodes."""

from __future__ import annotations

from dataclasses import dataclass

from ..nodes.builder import Tree, Value


@dataclass(frozen=True)
class Direction:
    """A unit vector in tangent space: its components along T, B and N, and the vector itself."""

    x: Value
    y: Value
    cosine: Value
    vector: Value

    @classmethod
    def seen_in(cls, tree: Tree, direction: Value, frame: tuple[Value, Value, Value]) -> Direction:
        """A direction from world space, given the axes (T, B, N)."""
        x, y, cosine = (tree.dot(direction, axis) for axis in frame)
        return cls(x, y, cosine, tree.vector(x, y, cosine))

    @classmethod
    def of(cls, tree: Tree, vector: Value) -> Direction:
        """A vector that is already in tangent space."""
        node = tree.node("ShaderNodeSeparateXYZ", vector)
        x, y, z = (tree.value(node.outputs[axis]) for axis in "XYZ")
        return cls(x, y, z, vector)
