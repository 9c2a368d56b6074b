# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffraction in materials: new materials, and adding it to or removing it from existing ones."""

from collections.abc import Iterable, Iterator
from math import isfinite

import bpy

from ...precompute.base.failure import GratingError
from ..blender import compat, stored
from ..gratings.material_look import BASE_COLOR, BASE_ROUGHNESS
from ..nodes.arrange import arrange
from ..nodes.builder import Tree
from ..nodes.eevee_constants import ROOM, constant_bytes
from .group_properties import is_diffraction
from .holograms.hologram_nodes import remove_hologram
from .skin import SETTABLE, too_large

# Cycles settings of a material with diffraction. The prefix names custom properties that hold the previous settings.
_TOLD = {"emission_sampling": "NONE", "use_bump_map_correction": False}
_BEFORE = "ng_"
# How far a Material Output moves to make room for a Diffraction node, in node editor units.
_STEP = 220
# The label of Diffraction nodes in materials, saved in files.
LABEL = "Diffraction"


def new_diffraction_material(
    name: str,
    group: bpy.types.NodeTree,
    *,
    base_color: Iterable[float] = BASE_COLOR,
    base_roughness: float = BASE_ROUGHNESS,
) -> bpy.types.Material:
    """A new material with a Diffraction group: a base, by default a dark skin, whose specular reflection is the
    diffraction."""
    material = bpy.data.materials.new(f"Diffraction {name}")
    compat.enable_nodes(material)
    material.node_tree.nodes.clear()
    tree = Tree(material.node_tree)
    skin = tree.node("ShaderNodeBsdfPrincipled", label="Skin")
    skin.inputs["Base Color"].default_value = (*base_color, 1.0)
    skin.inputs["Roughness"].default_value = base_roughness
    # The diffraction replaces the specular reflection, so the skin keeps only its diffuse part.
    skin.inputs["Specular IOR Level"].default_value = 0.0
    shader = tree.group(group, {"Base": tree.value(skin.outputs[0])}, label=LABEL)["Shader"]
    tree.node("ShaderNodeOutputMaterial", shader)
    arrange(material.node_tree)
    tell_cycles(material)
    return material


def check_can_add(material: bpy.types.Material) -> None:
    """Raise GratingError if diffraction cannot be added to a material."""
    check_can_change(material)
    if material.node_tree is not None and not _outputs(material):
        raise GratingError(material.name, "it has no Material Output node", "add one, and link a shader to it")


def check_can_change(material: bpy.types.Material) -> None:
    """Raise GratingError if a material's nodes cannot be changed, or if it shows no nodes."""
    foreign = material.library or (material.override_library and material.override_library.reference.library)
    if foreign:
        raise GratingError(
            material.name, f"linked from {foreign.filepath}", "use Make Local in the material's menu, or assign another"
        )
    if material.is_grease_pencil:
        raise GratingError(material.name, "it draws strokes, which show no diffraction", "assign another material")


def add_diffraction(material: bpy.types.Material, group: bpy.types.NodeTree) -> None:
    """Add a Diffraction group to a material, or replace the material's present one; nothing else changes.

    Every Material Output then shows it. Raises GratingError if the material cannot be changed."""
    check_can_add(material)
    compat.enable_nodes(material)
    for node in empty_nodes(material):
        _fill(node, group)
    present = diffraction_nodes(material)
    for node in present:
        node.node_tree, node.mute = group, False
    # Reuse nodes whose links were cut, to keep the values that an artist set on them.
    loose = [node for node in present if node.id_data == material.node_tree and not node.outputs["Shader"].is_linked]
    tree = Tree(material.node_tree)
    for output in _outputs(material):
        if _shows_diffraction(output):
            continue
        surface = output.inputs["Surface"]
        node = loose.pop() if loose else tree.node("ShaderNodeGroup", node_tree=group, label=LABEL)
        node.location = output.location
        output.location.x += _STEP
        if surface.is_linked:
            base = surface.links[0].from_socket
            tree.feed(node.inputs["Base"], tree.value(base))
            bump = base.node.inputs.get("Normal")
            if bump is not None and bump.is_linked:  # the relief follows the base's bump map
                tree.feed(node.inputs["Normal"], tree.value(bump.links[0].from_socket))
        tree.feed(surface, tree.value(node.outputs["Shader"]))
    tell_cycles(material)


def remove_diffraction(material: bpy.types.Material) -> None:
    """Remove diffraction from a material and restore its previous state."""
    for node in diffraction_nodes(material):
        remove_hologram(node)
        tree = node.id_data
        base = node.inputs["Base"].links[0].from_socket if linked_among(node, ["Base"]) else None
        for link in list(node.outputs["Shader"].links) if "Shader" in node.outputs else ():
            output = link.to_node
            if base is not None:
                tree.links.new(base, link.to_socket)
            output.location.x -= _STEP
        tree.nodes.remove(node)
    for setting in _TOLD:
        if _BEFORE + setting in material:
            setattr(material.cycles, setting, _before(material, setting))
            del material[_BEFORE + setting]


def _before(material: bpy.types.Material, setting: str) -> object:
    """The previous Cycles setting; Blender's default if the custom property was edited."""
    own = material.cycles.bl_rna.properties[setting]
    if own.type == "ENUM":
        return stored.choice(material.get(_BEFORE + setting), own.enum_items.keys(), own.default)
    return stored.flag(material, _BEFORE + setting, own.default)


def tell_cycles(material: bpy.types.Material) -> None:
    """Set Cycles not to sample the mesh as a lamp, and not to correct the normals of closures.

    Cycles treats diffraction as emission, although it is reflected lamplight; sampling it would cost time without
    reducing noise. An order's closure has the normal of the mirror that reflects the order, far from the surface's own.
    Cycles takes this for a bump map and would turn the normal towards the surface's."""
    for setting, value in _TOLD.items():
        # The property exists already if an artist deleted the Diffraction node by hand.
        if _BEFORE + setting not in material:
            material[_BEFORE + setting] = getattr(material.cycles, setting)
        setattr(material.cycles, setting, value)


def diffraction_nodes(material: bpy.types.Material | None) -> list[bpy.types.Node]:
    """The material's nodes with Diffraction groups, also inside other groups."""
    return [] if material is None else list(_diffraction_nodes(material.node_tree))


def shows_diffraction(material: bpy.types.Material, *, in_cycles: bool) -> bool:
    """Whether a material's output for Cycles or for EEVEE shows Diffraction nodes, none of which is muted."""
    output = material.node_tree.get_output_node("CYCLES" if in_cycles else "EEVEE")
    muted = any(node.mute for node in diffraction_nodes(material))
    return output is not None and not muted and _shows_diffraction(output)


def number_in(node: bpy.types.Node, name: str) -> float:
    """The number set at an input of a Diffraction node; the default if the input was deleted or holds no number."""
    value = getattr(node.inputs.get(name), "default_value", None)
    if isinstance(value, float) and isfinite(value):
        return value
    default = SETTABLE[name].default
    assert default is not None
    return default


def linked_among(node: bpy.types.Node, names: Iterable[str]) -> list[str]:
    """The names of a Diffraction node's inputs, among these, that are linked."""
    return [name for name in names if name in node.inputs and node.inputs[name].is_linked]


def empty_nodes(material: bpy.types.Material | None) -> list[bpy.types.Node]:
    """The Diffraction nodes in a material's own node tree whose group was deleted."""
    tree = None if material is None else material.node_tree
    nodes = tree.nodes if tree is not None else ()
    return [node for node in nodes if node.type == "GROUP" and node.node_tree is None and node.label == LABEL]


def _fill(node: bpy.types.Node, group: bpy.types.NodeTree) -> None:
    """Give an empty node a Diffraction group. Blender may have removed its links with the old group. If exactly one
    shader is unused, it was the base and is linked again."""
    tree = node.id_data
    node.node_tree = group
    if node.inputs["Base"].is_linked:
        return
    shaders = [socket for each in tree.nodes for socket in each.outputs if socket.type == "SHADER" and each != node]
    unshown = [socket for socket in shaders if not socket.is_linked]
    if len(unshown) == 1:
        tree.links.new(unshown[0], node.inputs["Base"])


def _diffraction_nodes(tree: bpy.types.NodeTree | None) -> Iterator[bpy.types.Node]:
    for node in tree.nodes if tree is not None else ():
        if node.type == "GROUP" and is_diffraction(node.node_tree):
            yield node
        elif node.type == "GROUP":
            yield from _diffraction_nodes(node.node_tree)


def _outputs(material: bpy.types.Material) -> list[bpy.types.Node]:
    return [n for n in material.node_tree.nodes if n.type == "OUTPUT_MATERIAL"]


def _shows_diffraction(output: bpy.types.Node) -> bool:
    """Whether a Diffraction node feeds a Material Output's surface, directly or through other nodes."""
    pending, seen = [link.from_node for link in output.inputs["Surface"].links], set()
    while pending:
        node = pending.pop()
        if node in seen:
            continue
        seen.add(node)
        if node.type == "GROUP" and (is_diffraction(node.node_tree) or any(_diffraction_nodes(node.node_tree))):
            return True
        pending += [link.from_node for socket in node.inputs for link in socket.links]
    return False


def overfull(materials: Iterable[bpy.types.Material]) -> list[str]:
    """One warning line for each material that has too many constants for EEVEE."""
    return [too_large(each.name) for each in materials if constant_bytes(each.node_tree) > ROOM]
