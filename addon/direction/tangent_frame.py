# SPDX-License-Identifier: GPL-3.0-or-later
"""The normal N and the tangent T of the scan on the surface, as nodes, of which only the chosen source adds some; and
direction maps, which are pictures of the scan's direction on the UV map of one mesh.

Red of a map is (1 + cos a) / 2 and green is (1 + sin a) / 2. The angle a turns the UV map's tangent (the direction of
U, orthogonal to the normal) to the scan's T, towards N x tangent."""

import bpy

from ...precompute.base.failure import GratingError
from ..blender import compat
from ..gratings.direction_source import (
    AXIS,
    BAKED_OF,
    COMB_TURN,
    COMB_UV,
    FRAME_MAP,
    RADIAL,
    STORED,
    DirectionSource,
    baked_of,
)
from ..nodes.builder import Tree, Value
from .uv_maps import fingerprint

# The label of the node that reads a direction map.
MAP_LABEL = "Direction Map"


def frame_nodes(tree: Tree, inputs: dict[str, Value], source: DirectionSource) -> tuple[Value, Value]:
    """The unit vectors N and T: the linked vectors, else the surface's normal and the source's tangent. T is made
    orthogonal to N, then turned by Rotation and by the object's angle if the source names one."""
    surface = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Normal"])
    n = tree.normalize(_linked_else(tree, inputs["Normal"], surface))
    t = across(tree, n, _linked_else(tree, inputs["Tangent"], tangent_nodes(tree, n, source)))
    rotation = inputs["Rotation"]
    if source.angle:
        node = tree.node(
            "ShaderNodeAttribute", attribute_type="OBJECT", attribute_name=source.angle, label=source.angle
        )
        rotation = rotation + tree.value(node.outputs["Fac"])
    return n, turned(tree, n, t, by=(tree.math("COSINE", rotation), tree.math("SINE", rotation)))


def tangent_nodes(tree: Tree, n: Value, source: DirectionSource) -> Value:
    """The tangent of a source, of any length, not yet orthogonal to the normal."""
    if source.kind == AXIS:
        return tree.from_object(source.axis_vector)
    if source.kind == RADIAL:
        # Remove the part of the position along the axis.
        place = tree.value(tree.node("ShaderNodeTexCoord").outputs["Object"])
        x, y, z = (1.0 - part for part in source.axis_vector)
        return tree.from_object(place * (x, y, z))
    along_u = uv_tangent(tree, source.named_uv_map)
    if source.kind == STORED and source.combed:
        return _linked_else(tree, combed_tangent(tree, n), along_u)
    if source.kind != FRAME_MAP or source.frame_map is None:
        return along_u
    uv = tree.value(tree.node("ShaderNodeUVMap", uv_map=source.named_uv_map).outputs["UV"])
    held = tree.image(source.frame_map, uv, MAP_LABEL).times_plus(2.0, (-1.0, -1.0, -1.0))
    cosine, sine, _ = tree.node("ShaderNodeSeparateXYZ", held).outputs
    return turned(tree, n, across(tree, n, along_u), by=(tree.value(cosine), tree.value(sine)))


def combed_tangent(tree: Tree, n: Value) -> Value:
    """The tangent that Comb Grating stored; 0 on a mesh without one."""
    held, _ = tree.attribute(COMB_TURN, "GEOMETRY")
    cosine, sine, _ = tree.outputs_of(tree.node("ShaderNodeSeparateXYZ", held)).values()
    return turned(tree, n, uv_tangent(tree, COMB_UV), by=(cosine, sine))


def uv_tangent(tree: Tree, uv_map: str) -> Value:
    """The direction of U of a UV map; an empty name stands for the map that renders."""
    return tree.value(tree.node("ShaderNodeTangent", direction_type="UV_MAP", uv_map=uv_map).outputs["Tangent"])


def across(tree: Tree, n: Value, tangent: Value) -> Value:
    """The part of a tangent that is orthogonal to the normal, normalised."""
    return tree.normalize(tangent - n * tree.dot(n, tangent))


def turned(tree: Tree, n: Value, t: Value, *, by: tuple[Value, Value]) -> Value:
    """Turn a unit tangent about the normal, from T towards N x T. `by`: cosine and sine of the angle."""
    cosine, sine = by
    return t * cosine + tree.cross(n, t) * sine


def frame_maps_in(group: bpy.types.NodeTree) -> list[bpy.types.Image]:
    """The direction maps that a Diffraction group reads."""
    return [node.image for node in group.nodes if node.type == "TEX_IMAGE" and node.label == MAP_LABEL and node.image]


def _linked_else(tree: Tree, linked: Value, own: Value) -> Value:
    """The linked vector, or `own` where nothing is linked."""
    return linked + own * tree.math("LESS_THAN", tree.dot(linked, linked), 1e-6)


def new_map(name: str, size: int) -> bpy.types.Image:
    """A new picture for a direction map: non-colour data in single precision, so that Blender does not convert it."""
    image = bpy.data.images.new(name, size, size, alpha=False, float_buffer=True)
    image.colorspace_settings.is_data = True  # independent of the colour configuration's names
    image.alpha_mode, image.use_half_precision = "NONE", False
    return image


def baking_material(source: DirectionSource, uv_map: str, image: bpy.types.Image) -> bpy.types.Material:
    """A material that emits the direction map of a source, relative to a UV map. Cycles bakes into its active node."""
    material = bpy.data.materials.new("Direction Map")
    compat.enable_nodes(material)
    material.node_tree.nodes.clear()
    tree = Tree(material.node_tree)
    n = tree.value(tree.node("ShaderNodeNewGeometry").outputs["Normal"])
    t = across(tree, n, tangent_nodes(tree, n, source))
    along_u = across(tree, n, uv_tangent(tree, uv_map))
    cosine, sine = tree.dot(t, along_u), tree.dot(t, tree.cross(n, along_u))
    held = tree.vector(cosine.times_plus(0.5, 0.5), sine.times_plus(0.5, 0.5), 0.0)
    tree.node("ShaderNodeOutputMaterial", tree.emission(held, 1.0))
    material.node_tree.nodes.active = tree.node("ShaderNodeTexImage", image=image)
    return material


def note_mesh(image: bpy.types.Image, mesh: bpy.types.Object, uv_map: str) -> None:
    """Store the mesh and the UV map of which a direction map was baked on its picture."""
    image[BAKED_OF] = {"uv_map": uv_map, "mesh": mesh.name, "fingerprint": fingerprint(mesh.data, uv_map)}


def check_frame_map(mesh: bpy.types.Object, image: bpy.types.Image) -> None:
    """Raise GratingError if a direction map was baked of other faces or another UV map. The mesh must have the map."""
    noted = baked_of(image)
    if fingerprint(mesh.data, noted["uv_map"]) != noted["fingerprint"]:
        raise GratingError(
            mesh.name,
            f"the direction map {image.name} was baked of {noted['mesh']}, with other faces or another "
            f"{noted['uv_map']}",
            "use Bake Direction Map on this mesh",
        )
