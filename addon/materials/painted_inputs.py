# SPDX-License-Identifier: GPL-3.0-or-later
"""A painted input of a Diffraction node: a mask from a colour attribute or a texture, mapped to the input's range."""

from math import pi

import bpy

# The inputs that can be painted, each with what black and white stand for. None stands for the input's number.
RANGES: dict[str, tuple[float, float | None]] = {
    "Strength": (0.0, None),
    "Rotation": (-pi / 2, pi / 2),
    "Period Scale": (0.8, 1.25),
}
_LABEL = "Painted"
# How far to the left of the Diffraction node the nodes stand, in node editor units.
_STEP = 220


def paint_of(socket: bpy.types.NodeSocket) -> bpy.types.Node | None:
    """The node that maps the mask which feeds an input, or None if the input is not painted."""
    links = socket.links
    node = links[0].from_node if links else None
    return node if node is not None and node.type == "MAP_RANGE" and node.label == _LABEL else None


def put_paint(socket: bpy.types.NodeSocket, mask: str | bpy.types.Image) -> None:
    """Let a mask set an input of a Diffraction node: a colour attribute by its name, or a texture on the UV map that
    renders. The input keeps its number, which Strength has where the mask is white."""
    tree, node = socket.node.id_data, socket.node
    low, high = RANGES[socket.name]
    if isinstance(mask, str):
        source = tree.nodes.new("ShaderNodeAttribute")
        source.attribute_name = mask
    else:
        source = tree.nodes.new("ShaderNodeTexImage")
        source.image = mask
    spread = tree.nodes.new("ShaderNodeMapRange")
    spread.label = _LABEL
    spread.inputs["To Min"].default_value = low
    spread.inputs["To Max"].default_value = (socket.default_value or 1.0) if high is None else high
    below = list(RANGES).index(socket.name)
    for column, each in enumerate((spread, source), 1):
        each.location = (node.location.x - column * _STEP, node.location.y - below * _STEP)
    tree.links.new(source.outputs["Color"], spread.inputs["Value"])
    tree.links.new(spread.outputs["Result"], socket)


def remove_paint(socket: bpy.types.NodeSocket) -> None:
    """Give a painted input its number back, and remove the nodes. The attribute or the texture stays."""
    spread = paint_of(socket)
    if spread is None:
        return
    tree = spread.id_data
    sources = [link.from_node for link in spread.inputs["Value"].links]
    tree.nodes.remove(spread)
    for source in sources:
        if not any(output.is_linked for output in source.outputs):
            tree.nodes.remove(source)
