# SPDX-License-Identifier: GPL-3.0-or-later
"""Diffraction in materials: new materials, adding it to or removing it from existing ones, which objects show it, and
which Diffraction groups belong to no grating of the scene."""

from collections.abc import Iterable, Iterator
from collections.abc import Set as AbstractSet
from math import isfinite
from pathlib import Path

import bpy
import numpy as np

from ...precompute.base.failure import GratingError
from ..blender import compat, stored
from ..gratings.material_look import BASE_COLOR, BASE_ROUGHNESS
from ..gratings.wording import translated
from ..lamps.follow import lamp_count
from ..nodes.builder import Tree
from ..nodes.interface import GROUP_WIDTH, ROOM, arrange, size_of
from .group_properties import diffraction_groups, is_diffraction, lamps_in
from .pictures import pictures_of
from .response import own_trees
from .skin import SETTABLE, too_large

# Cycles settings of a material with diffraction. The prefix names custom properties that hold the previous settings.
_TOLD = {"emission_sampling": "NONE", "use_bump_map_correction": False}
_BEFORE = "ng_"
# How far a Material Output moves to make room for a Diffraction node, in node editor units.
_STEP = GROUP_WIDTH + 60
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
        node.location, node.width = output.location, group.default_group_node_width
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
    from .holograms.hologram_nodes import remove_hologram  # most sessions begin without it

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
    return [too_large(each.name) for each in materials if size_of(each.node_tree).constant_bytes > ROOM]


# The number of object names that fit into a line of the panel.
_NAMES_MAX = 3


def materials_with(group: bpy.types.NodeTree) -> list[bpy.types.Material]:
    """The file's materials that contain a Diffraction group, also inside another group, by name."""
    return sorted(_materials_of({group}), key=lambda material: material.name_full)


def _materials_of(groups: set[bpy.types.NodeTree]) -> set[bpy.types.Material]:
    """The file's materials that contain one of these Diffraction groups."""
    found, seen, pending = set(), set(), groups
    while pending:
        seen |= pending
        users = _users(pending, "MATERIAL", "NODETREE")
        found |= {user for user in users if isinstance(user, bpy.types.Material)}
        pending = {user for user in users if isinstance(user, bpy.types.NodeTree)} - seen
    return {m for m in found if any(node.node_tree in groups for node in diffraction_nodes(m))}


def shown_by(group: bpy.types.NodeTree | None) -> list[bpy.types.Object]:
    """The file's objects whose materials contain a Diffraction group, by name. Of a linked object and its library
    override, only the override."""
    shown = set() if group is None else _objects_with(_materials_of({group}))
    overridden = {thing.override_library.reference for thing in shown if thing.override_library is not None}
    return sorted(shown - overridden, key=lambda thing: thing.name_full)


def _objects_with(materials: set[bpy.types.Material]) -> set[bpy.types.Object]:
    """The file's objects that have one of these materials."""
    users = _users(materials)
    objects = {user for user in users | _users(users, "OBJECT") if isinstance(user, bpy.types.Object)}
    return {thing for thing in objects if any(slot.material in materials for slot in thing.material_slots)}


def boxes_showing(scene: bpy.types.Scene) -> np.ndarray:
    """The bounding boxes (n, 2, 3) of the scene's objects that show diffraction: minimum and maximum corners in world
    space. Objects that appear only in collection instances are left out."""
    corners = np.array([_corners(thing) for thing in _showing(scene)]).reshape(-1, 8, 3)
    return np.stack([corners.min(axis=1), corners.max(axis=1)], axis=1)


def outside_light_groups(scene: bpy.types.Scene) -> list[str]:
    """One warning line if the scene has light groups and objects whose diffraction is in none of them. Diffraction is
    emission to Cycles, which files it under the light group of the object, not of the lamp."""
    if scene.render.engine != "CYCLES" or not any(layer.lightgroups for layer in scene.view_layers):
        return []
    outside = sorted((thing for thing in _showing(scene) if not thing.lightgroup), key=lambda thing: thing.name)
    remedy = "give the object a light group of its own (Object > Shading)"
    return [f"No light group has the diffraction of {listed(outside)}; {remedy}"] if outside else []


def _showing(scene: bpy.types.Scene) -> set[bpy.types.Object]:
    """The scene's objects that show diffraction."""
    shown = _objects_with(_materials_of(set(diffraction_groups())))
    return shown & set(scene.collection.all_objects) if shown else shown


def _corners(thing: bpy.types.Object) -> np.ndarray:
    """The corners (8, 3) of an object's bounding box in world space, as it was last evaluated."""
    matrix = np.array(thing.matrix_world)
    return np.array([corner[:] for corner in thing.bound_box]) @ matrix[:3, :3].T + matrix[:3, 3]


def on_objects(objects: list[bpy.types.Object]) -> str:
    """One line that names objects: "On: Snake, Ball and 3 more"."""
    return translated("On: {names}", names=listed(objects)) if objects else translated("On no object")


def listed(things: Iterable[bpy.types.ID]) -> str:
    """The names of data-blocks: "Sun, Lamp and 3 more"."""
    names = [thing.name for thing in things]
    if len(names) > _NAMES_MAX:
        names = [*names[: _NAMES_MAX - 1], translated("{count} more", count=len(names) - _NAMES_MAX + 1)]
    if len(names) < 2:
        return "".join(names)
    return translated("{names} and {last}", names=", ".join(names[:-1]), last=names[-1])


def strays(scene: bpy.types.Scene) -> list[bpy.types.NodeTree]:
    """The Diffraction groups of bakes that objects show but no grating of the scene owns, so the panel does not list
    them: appended, pasted, linked, or left by a removed grating. Groups of other scenes count if objects here show
    them."""
    own = {grating.group for grating in scene.natural_gratings.items}
    groups = [group for group in diffraction_groups() if group not in own]
    return [group for group in groups if _shows_bake(group) and _is_stray(group, scene)]


def linked_strays(scene: bpy.types.Scene, groups: list[bpy.types.NodeTree]) -> list[GratingError]:
    """One error for each stray group that is linked from another file. It says if the scene has more lamps than the
    group reads, as a linked group cannot be changed."""
    remedy = "to adopt it, select its objects and use Object > Relations > Make Local > All first"
    count = lamp_count(scene)
    return [
        GratingError(group.name, _linked_with(group, count), remedy) for group in groups if group.library is not None
    ]


def _linked_with(group: bpy.types.NodeTree, lamps: int) -> str:
    read, linked = len(lamps_in(group)), f"linked from {Path(group.library.filepath).name}"
    return f"{linked} with only {read} of {lamps} lamps" if read < lamps else linked


def owners(group: bpy.types.NodeTree) -> list[bpy.types.Scene]:
    """The file's scenes with a grating that owns a Diffraction group."""
    return [s for s in bpy.data.scenes if any(grating.group == group for grating in s.natural_gratings.items)]


def _is_stray(group: bpy.types.NodeTree, scene: bpy.types.Scene) -> bool:
    """Whether to offer a Diffraction group to the scene, given that no grating of the scene owns it."""
    things = shown_by(group)
    return any(scene in thing.users_scene for thing in things) if owners(group) else bool(things)


def _shows_bake(group: bpy.types.NodeTree) -> bool:
    """Whether a Diffraction group shows a bake, not an OSL shader."""
    tree, _ = own_trees(group)
    return tree is not None and bool(pictures_of(tree))


def _users(used: AbstractSet[bpy.types.ID], *kinds: str) -> set[bpy.types.ID]:
    """The data-blocks that use any of these, of the given kinds or of all."""
    found = bpy.data.user_map(subset=used, **({"value_types": set(kinds)} if kinds else {})) if used else {}
    return set().union(*found.values())
