# SPDX-License-Identifier: GPL-3.0-or-later
"""A hologram in a material: the node of its pattern before a Diffraction node.

The pattern's inputs take over the values and links that the Diffraction node had. Removing it gives them back."""

from collections.abc import Iterable, Mapping

import bpy

from ...blender import compat
from .pattern_nodes import pattern_of
from .patterns import CHANGED, LABELS

# How far to the left of a Diffraction node its hologram stands, and the hologram's UV map of it, in node editor units.
_STEP = 260


def hologram_of(node: bpy.types.Node) -> bpy.types.Node | None:
    """The node of the pattern that feeds a Diffraction node, or None."""
    for name in CHANGED:
        source = _source(node, name)
        if source is not None and source.node.type == "GROUP" and pattern_of(source.node.node_tree):
            return source.node
    return None


def put_hologram(
    node: bpy.types.Node, group: bpy.types.NodeTree, values: Mapping[str, float], *, uv_map: str = ""
) -> None:
    """Put a pattern before a Diffraction node, in place of its present one. `values` has numbers for the pattern's
    inputs. An empty `uv_map` stands for the map that renders. A link to the present pattern's Vector is kept."""
    tree, former = node.id_data, hologram_of(node)
    place = None if former is None or uv_map else _source(former, "Vector")
    at = (node.location.x - _STEP, node.location.y - _STEP)
    made = add_pattern(tree, group, at, place=place, uv_map=uv_map)
    _hand_over(CHANGED, node, made, past=former)
    for name in CHANGED:
        if name in node.inputs:
            tree.links.new(made.outputs[name], node.inputs[name])
    for name, value in values.items():
        made.inputs[name].default_value = value
    _remove_unused(former)


def add_pattern(
    tree: bpy.types.NodeTree, group: bpy.types.NodeTree, at: tuple[float, float], *,
    place: bpy.types.NodeSocket | None = None, uv_map: str = "",
) -> bpy.types.Node:  # fmt: skip
    """Add a pattern's node at a location. It follows `place`, else a UV Map node of its own."""
    made = tree.nodes.new("ShaderNodeGroup")
    made.node_tree, made.label, made.location = group, LABELS[pattern_of(group)], at
    if place is None:
        node = tree.nodes.new("ShaderNodeUVMap")
        node.uv_map, node.location = uv_map, (at[0] - _STEP, at[1])
        place = node.outputs["UV"]
    tree.links.new(place, made.inputs["Vector"])
    return made


def remove_hologram(node: bpy.types.Node) -> None:
    """Remove the pattern before a Diffraction node, which gets back its own values and links."""
    former = hologram_of(node)
    if former is None:
        return
    fed = [name for name in CHANGED if (source := _source(node, name)) is not None and source.node == former]
    for name in fed:
        node.id_data.links.remove(node.inputs[name].links[0])
    _hand_over(fed, former, node)
    _remove_unused(former)


def input_set_by_artist(node: bpy.types.Node, name: str) -> bpy.types.NodeSocket:
    """The socket that holds the artist's number for an input of a Diffraction node: the hologram's if one feeds it."""
    former, source = hologram_of(node), _source(node, name)
    if former is None or source is None or source.node != former or name not in former.inputs:
        return node.inputs[name]
    return former.inputs[name]


def _hand_over(
    names: Iterable[str], giver: bpy.types.Node, taker: bpy.types.Node, *, past: bpy.types.Node | None = None
) -> None:
    """Give the values and links of inputs to another node. Where `past` feeds the giver, its own input gives."""
    tree = giver.id_data
    for name in names:
        if name not in giver.inputs or name not in taker.inputs:  # an artist may have deleted a socket
            continue
        source = _source(giver, name)
        holder = giver
        if past is not None and source is not None and source.node == past and name in past.inputs:
            holder, source = past, _source(past, name)
        if holder.inputs[name].type == taker.inputs[name].type:  # an artist may have changed one
            taker.inputs[name].default_value = holder.inputs[name].default_value
        if source is not None:
            tree.links.new(source, taker.inputs[name])


def _source(node: bpy.types.Node, name: str) -> bpy.types.NodeSocket | None:
    """The socket that an input of a node is linked to, or None."""
    links = node.inputs[name].links if name in node.inputs else ()
    return links[0].from_socket if links else None


def _remove_unused(former: bpy.types.Node | None) -> None:
    """Remove a pattern's node, its UV Map node and its group, as far as nothing else uses them."""
    if former is None or any(socket.is_linked for socket in former.outputs):
        return
    tree, group, place = former.id_data, former.node_tree, _source(former, "Vector")
    at = None if place is None else place.node
    tree.nodes.remove(former)
    if at is not None and at.type == "UVMAP" and not at.outputs["UV"].is_linked:
        tree.nodes.remove(at)
    if group.users == 0:
        compat.remove_replaced(group)
