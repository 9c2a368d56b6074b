# SPDX-License-Identifier: GPL-3.0-or-later
"""Direction maps: pictures that hold the direction of a scan, on a UV map of one mesh.

A pixel's red and green are (1 + cos a) / 2 and (1 + sin a) / 2, where a is the angle from the UV map's tangent, the
direction of U across the normal, to the scan's T, towards N x tangent."""

import bpy

from ...precompute.base.failure import GratingError
from ..blender import compat
from ..gratings.direction_source import BAKED_OF, DirectionSource, baked_of
from ..nodes.builder import Tree
from .tangent_frame import across, tangent_nodes, uv_tangent
from .uv_maps import fingerprint


def new_map(name: str, size: int) -> bpy.types.Image:
    """A new picture for a direction map: data in single precision, that no renderer may resample."""
    image = bpy.data.images.new(name, size, size, alpha=False, float_buffer=True)
    image.colorspace_settings.is_data = True  # whatever a studio's configuration calls its data
    image.alpha_mode, image.use_half_precision = "NONE", False
    return image


def baking_material(source: DirectionSource, uv_map: str, image: bpy.types.Image) -> bpy.types.Material:
    """A material that shines as a direction map of a source's T is to hold it, relative to a UV map, and names the
    picture that Cycles is to bake this into."""
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
    """Note on a direction map of which mesh and UV map it was baked."""
    image[BAKED_OF] = {"uv_map": uv_map, "mesh": mesh.name, "fingerprint": fingerprint(mesh.data, uv_map)}


def check_frame_map(mesh: bpy.types.Object, image: bpy.types.Image) -> None:
    """Raise GratingError unless a direction map was baked of this mesh, which has its UV map, as both are now."""
    noted = baked_of(image)
    if fingerprint(mesh.data, noted["uv_map"]) != noted["fingerprint"]:
        raise GratingError(
            mesh.name,
            f"the direction map {image.name} was baked of {noted['mesh']}, with other faces or another "
            f"{noted['uv_map']}",
            "use Bake Direction Map on this mesh",
        )
