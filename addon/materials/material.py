# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffraction in materials: made new, laid over an existing material, removed from it."""

from collections.abc import Iterable, Iterator
from math import isfinite

import bpy

from ...precompute.base.failure import GratingError
from ..blender import compat, stored
from ..nodes.arrange import arrange
from ..nodes.builder import Tree
from ..nodes.eevee_constants import ROOM, constant_bytes
from .group_properties import is_diffraction
from .skin import SETTABLE, too_large

_SKIN = (0.012, 0.010, 0.009, 1.0)
# What Cycles is told of a material with diffraction. The prefix names the material's custom properties that hold what
# Cycles was told before.
_TOLD = {"emission_sampling": "NONE", "use_bump_map_correction": False}
_BEFORE = "ng_"
# By how much a Material Output makes room for a Diffraction node, in the node editor's units.
_STEP = 220
# The label of Diffraction nodes in materials, also in saved files.
_LABEL = "Diffraction"


def new_diffraction_material(name: str, group: bpy.types.NodeTree) -> bpy.types.Material:
    """A new material of a Diffraction group: a dark skin whose specular reflection is the diffraction."""
    material = bpy.data.materials.new(f"Diffraction {name}")
    compat.enable_nodes(material)
    material.node_tree.nodes.clear()
    tree = Tree(material.node_tree)
    skin = tree.node("ShaderNodeBsdfPrincipled", label="Skin")
    skin.inputs["Base Color"].default_value = _SKIN
    skin.inputs["Roughness"].default_value = 0.6
    # The diffraction is the surface's specular reflection: the skin below keeps only its diffuse part.
    skin.inputs["Specular IOR Level"].default_value = 0.0
    shader = tree.group(group, {"Base": tree.value(skin.outputs[0])}, label=_LABEL)["Shader"]
    tree.node("ShaderNodeOutputMaterial", shader)
    arrange(material.node_tree)
    tell_cycles(material)
    return material


def check_can_add(material: bpy.types.Material) -> None:
    """Raise GratingError where diffraction cannot be laid over a material."""
    foreign = material.library or (material.override_library and material.override_library.reference.library)
    if foreign:
        raise GratingError(
            material.name, f"linked from {foreign.filepath}", "use Make Local in the material's menu, or assign another"
        )
    if material.is_grease_pencil:
        raise GratingError(material.name, "it draws strokes, which show no diffraction", "assign another material")
    if material.node_tree is not None and not _outputs(material):
        raise GratingError(material.name, "it has no Material Output node", "add one, and link a shader to it")


def add_diffraction(material: bpy.types.Material, group: bpy.types.NodeTree) -> None:
    """Lay a Diffraction group over a material, or put it in place of the one that is there; nothing else changes.

    Every Material Output shows it then. Raises GratingError where a material cannot be changed."""
    check_can_add(material)
    compat.enable_nodes(material)
    for node in empty_nodes(material):
        _fill(node, group)
    present = diffraction_nodes(material)
    for node in present:
        node.node_tree, node.mute = group, False
    # What an artist set on a node whose link was cut is not lost.
    loose = [node for node in present if node.id_data == material.node_tree and not node.outputs["Shader"].is_linked]
    tree = Tree(material.node_tree)
    for output in _outputs(material):
        if _shows_diffraction(output):
            continue
        surface = output.inputs["Surface"]
        node = loose.pop() if loose else tree.node("ShaderNodeGroup", node_tree=group, label=_LABEL)
        node.location = output.location
        output.location.x += _STEP
        if surface.is_linked:
            base = surface.links[0].from_socket
            tree.feed(node.inputs["Base"], tree.value(base))
            bump = base.node.inputs.get("Normal")
            if bump is not None and bump.is_linked:  # the relief follows the bumps that the artist gave the base
                tree.feed(node.inputs["Normal"], tree.value(bump.links[0].from_socket))
        tree.feed(surface, tree.value(node.outputs["Shader"]))
    tell_cycles(material)


def remove_diffraction(material: bpy.types.Material) -> None:
    """Remove diffraction from a material and leave the material as it was before."""
    for node in diffraction_nodes(material):
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
    """What Cycles was told before; Blender's default where the note of it was edited."""
    own = material.cycles.bl_rna.properties[setting]
    if own.type == "ENUM":
        return stored.choice(material.get(_BEFORE + setting), own.enum_items.keys(), own.default)
    return stored.flag(material, _BEFORE + setting, own.default)


def tell_cycles(material: bpy.types.Material) -> None:
    """Have Cycles not sample the mesh as a lamp, and not bend the normals of closures.

    Diffraction is emission to Cycles, though it is reflected lamplight, and sampling it would take time without
    reducing noise. An order's closure has the normal of the mirror that would send it, which is far from the surface's
    own; Cycles takes that for a bump map, and would turn it towards the surface's."""
    for setting, value in _TOLD.items():
        # The note is there already where an artist deleted the Diffraction node by hand.
        if _BEFORE + setting not in material:
            material[_BEFORE + setting] = getattr(material.cycles, setting)
        setattr(material.cycles, setting, value)


def diffraction_nodes(material: bpy.types.Material | None) -> list[bpy.types.Node]:
    """The material's nodes of Diffraction groups, also those that an artist put into a group."""
    return [] if material is None else list(_diffraction_nodes(material.node_tree))


def number_in(node: bpy.types.Node, name: str) -> float:
    """What an artist set at an input of a Diffraction node; the input's default where it was deleted, or holds no
    number."""
    value = getattr(node.inputs.get(name), "default_value", None)
    if isinstance(value, float) and isfinite(value):
        return value
    default = SETTABLE[name].default
    assert default is not None
    return default


def linked_among(node: bpy.types.Node, names: Iterable[str]) -> list[str]:
    """The inputs of a Diffraction node, among these names, to which something is linked."""
    return [name for name in names if name in node.inputs and node.inputs[name].is_linked]


def empty_nodes(material: bpy.types.Material | None) -> list[bpy.types.Node]:
    """The Diffraction nodes in a material's own node tree whose group an artist has deleted."""
    tree = None if material is None else material.node_tree
    nodes = tree.nodes if tree is not None else ()
    return [node for node in nodes if node.type == "GROUP" and node.node_tree is None and node.label == _LABEL]


def _fill(node: bpy.types.Node, group: bpy.types.NodeTree) -> None:
    """Give an empty node a Diffraction group. Blender may have removed its links with the former group. The one shader
    that nothing shows any more was its base."""
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
    """Whether a Diffraction node is among the nodes that feed a Material Output's surface."""
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
    """A line for each material whose own nodes leave EEVEE no room for the Diffraction group in it."""
    return [too_large(each.name) for each in materials if constant_bytes(each.node_tree) > ROOM]
