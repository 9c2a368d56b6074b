# SPDX-License-Identifier: GPL-3.0-or-later
"""Direction maps: pictures of the scan's direction on the UV map of one mesh.

Red is (1 + cos a) / 2 and green is (1 + sin a) / 2. The angle a turns the UV map's tangent (the direction of U,
orthogonal to the normal) to the scan's T, towards N x tangent."""

import bpy

from ...precompute.base.failure import GratingError
from ..blender import compat
from ..gratings.direction_source import BAKED_OF, DirectionSource, baked_of
from ..nodes.builder import Tree
from .tangent_frame import across, tangent_nodes, uv_tangent
from .uv_maps import fingerprint


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
