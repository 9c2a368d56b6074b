# SPDX-License-Identifier: GPL-3.0-or-later
"""The diffraction material: a dark skin whose specular reflection is replaced by what the grating diffracts."""

from pathlib import Path

import bpy

from ...precompute import atlas
from ...precompute.colour import rgb_from_xyz
from .. import compat
from .builder import Tree
from .direct import build_direct_group

_SKIN = (0.012, 0.010, 0.009, 1.0)


def load_atlas(path: Path, half: bool) -> bpy.types.Image:
    """The bake's image, packed into the .blend so that it renders wherever the file goes; on a graphics card in half
    floats only where those hold it."""
    image = bpy.data.images.load(str(path), check_existing=False)
    image.name = path.stem
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "NONE"
    image.use_half_precision = half
    image.pack()
    return image


def new_diffraction_material(path: Path) -> bpy.types.Material:
    """A material for a bake file. Raises GratingError if the file is not a bake."""
    layout, record = atlas.read_header(path)
    image = load_atlas(path, half=record.get("precision") != "float32")
    matrix = rgb_from_xyz(compat.working_space(), layout.illuminant)
    group = build_direct_group(path.stem, image, layout, matrix)

    material = bpy.data.materials.new(f"Diffraction {path.stem}")
    compat.enable_nodes(material)
    material.node_tree.nodes.clear()
    tree = Tree(material.node_tree)
    frame = tree.node("ShaderNodeTangent", direction_type="UV_MAP", label="Grating direction: UV map's U")
    geometry = tree.node("ShaderNodeNewGeometry")
    diffraction = tree.node("ShaderNodeGroup", node_tree=group, label="Diffraction")
    tree.feed(diffraction.inputs["Normal"], tree.value(geometry.outputs["Normal"]))
    tree.feed(diffraction.inputs["Tangent"], tree.value(frame.outputs["Tangent"]))
    emission = tree.node("ShaderNodeEmission", tree.value(diffraction.outputs["Radiance"]))
    skin = tree.node("ShaderNodeBsdfPrincipled", label="Skin")
    skin.inputs["Base Color"].default_value = _SKIN
    skin.inputs["Roughness"].default_value = 0.6
    # The diffraction is the surface's specular reflection: the skin below keeps only its diffuse part.
    skin.inputs["Specular IOR Level"].default_value = 0.0
    both = tree.node("ShaderNodeAddShader", tree.value(skin.outputs[0]), tree.value(emission.outputs[0]))
    tree.node("ShaderNodeOutputMaterial", tree.value(both.outputs[0]))
    _arrange(material.node_tree)
    _arrange(group)
    # Its glow is reflected sunlight: Cycles must not sample the mesh as a lamp (slower, and no less noise).
    material.cycles.emission_sampling = "NONE"
    return material


def _arrange(tree: bpy.types.NodeTree) -> None:
    """Place nodes in columns by their distance from the inputs, so that the tree can be read."""
    depth: dict[bpy.types.Node, int] = {}
    for node in tree.nodes:  # nodes were made in the order of the formula: inputs come before their users
        before = [depth.get(link.from_node, 0) for socket in node.inputs for link in socket.links]
        depth[node] = 1 + max(before, default=-1)
    filled: dict[int, int] = {}
    for node, column in depth.items():
        row = filled.get(column, 0)
        filled[column] = row + 1
        node.location = (column * 220, -row * 220)
