# SPDX-License-Identifier: GPL-3.0-or-later
"""The frame of the scan on the surface: the normal N and the tangent T, as nodes."""

from ..nodes.builder import Tree, Value


def frame_nodes(tree: Tree, inputs: dict[str, Value]) -> tuple[Value, Value]:
    """The unit vectors N and T: the linked vectors, else the surface's own. T is made orthogonal to N and then
    turned by Rotation."""
    surface = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Normal"])
    along_u = tree.value(tree.node("ShaderNodeTangent", direction_type="UV_MAP").outputs["Tangent"])
    n, tangent = (
        linked + own * tree.math("LESS_THAN", tree.dot(linked, linked), 1e-6)
        for linked, own in ((inputs["Normal"], surface), (inputs["Tangent"], along_u))
    )
    n = tree.normalize(n)
    t = tree.normalize(tangent - n * tree.dot(n, tangent))
    b = tree.cross(n, t)
    rotation = inputs["Rotation"]
    return n, t * tree.math("COSINE", rotation) + b * tree.math("SINE", rotation)
