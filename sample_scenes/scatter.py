# SPDX-License-Identifier: GPL-3.0-or-later
"""Instances of a few meshes at many points, by Geometry Nodes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import bpy
import numpy as np

from .stage import add_object


class Scattered(NamedTuple):
    """Places of n instances: points (n, 3), Euler angles (n, 3), sizes (n,), and the index of each one's mesh (n,)."""

    points: np.ndarray
    turns: np.ndarray
    sizes: np.ndarray
    kinds: np.ndarray


def instance_on_points(
    scene: bpy.types.Scene, name: str, places: Scattered, meshes: Sequence[bpy.types.Mesh]
) -> bpy.types.Object:
    """Add an object that shows one of the meshes at each place. The names of the meshes must sort in their order."""
    originals = bpy.data.collections.new(name)
    for mesh in meshes:
        originals.objects.link(bpy.data.objects.new(mesh.name, mesh))
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(places.points))
    mesh.vertices.foreach_set("co", places.points.astype(np.float32).ravel())
    for attribute, kind, field, values in (
        ("turn", "FLOAT_VECTOR", "vector", places.turns.astype(np.float32)),
        ("size", "FLOAT", "value", places.sizes.astype(np.float32)),
        ("kind", "INT", "value", places.kinds.astype(np.int32)),
    ):
        mesh.attributes.new(attribute, kind, "POINT").data.foreach_set(field, values.ravel())
    shown = add_object(scene, name, mesh)
    shown.modifiers.new("Scatter", "NODES").node_group = _scatter_nodes(name, originals)
    return shown


def _scatter_nodes(name: str, originals: bpy.types.Collection) -> bpy.types.NodeTree:
    """Geometry nodes that put an object of the collection on each vertex, as its attributes say."""
    tree = bpy.data.node_groups.new(name, "GeometryNodeTree")
    tree.is_modifier = True
    for side in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=side, socket_type="NodeSocketGeometry")
    nodes, links = tree.nodes, tree.links
    points, shown = nodes.new("NodeGroupInput"), nodes.new("NodeGroupOutput")
    scatter, picked = nodes.new("GeometryNodeInstanceOnPoints"), nodes.new("GeometryNodeCollectionInfo")
    picked.inputs["Collection"].default_value = originals
    picked.inputs["Separate Children"].default_value = picked.inputs["Reset Children"].default_value = True
    scatter.inputs["Pick Instance"].default_value = True
    links.new(points.outputs[0], scatter.inputs["Points"])
    links.new(picked.outputs[0], scatter.inputs["Instance"])
    for attribute, kind, socket in (
        ("turn", "FLOAT_VECTOR", "Rotation"),
        ("size", "FLOAT", "Scale"),
        ("kind", "INT", "Instance Index"),
    ):
        read = nodes.new("GeometryNodeInputNamedAttribute")
        read.data_type = kind
        read.inputs["Name"].default_value = attribute
        links.new(read.outputs["Attribute"], scatter.inputs[socket])
    links.new(scatter.outputs[0], shown.inputs[0])
    return tree
