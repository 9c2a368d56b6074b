# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding nodes to the node tree that an artist has open in the shader editor: a grating's Diffraction group, ready to
use, or a hologram's pattern.

The new nodes are selected, and the first is active, so that they can follow the mouse together."""

from dataclasses import dataclass

import bpy

from ...precompute.base.failure import GratingError
from ..direction.uv_maps import has_uv_map
from ..gratings.direction_source import DIRECTION_REMEDY
from ..gratings.grating import Grating, active_grating
from ..materials.holograms.hologram_nodes import add_pattern
from ..materials.holograms.pattern_nodes import pattern_group
from ..materials.holograms.patterns import LABELS
from ..materials.material import LABEL, check_can_change, overfull, tell_cycles
from .adding_holograms import fit_hologram, fit_pattern
from .adding_presets import import_preset
from .assigning import further, prepared
from .baking import bake_and_wait
from .making_materials import beginning_of, group_of


@dataclass(frozen=True)
class Place:
    """Where a node is added: a material, its own node tree or a group's in it that is open, and the node's location."""

    material: bpy.types.Material
    tree: bpy.types.ShaderNodeTree
    location: tuple[float, float]


def add_grating_node(scene: bpy.types.Scene, name: str, place: Place) -> list[str]:
    """Add the Diffraction group of a scene's grating; the active one's if the name is empty. Its inputs begin as the
    grating's look says. Returns lines to report. Raises GratingError, with nothing added, if there is no such grating,
    it is not baked, its look is damaged, or the material cannot be changed."""
    grating = _grating(scene, name)
    check_can_change(place.material)
    if grating.own_group is not None and grating.own_group.contains_tree(place.tree):
        raise GratingError(grating.name, "its own node group is open", "press Tab to leave the group first")
    begin, group = beginning_of(grating), group_of(scene, grating)
    _deselect(place.tree)
    node = place.tree.nodes.new("ShaderNodeGroup")
    node.node_tree, node.label, node.location = group, LABEL, place.location
    node.width = group.default_group_node_width
    begin([node])
    place.tree.nodes.active = node
    meshes = _meshes_with(scene, place.material)
    fit_hologram([node], meshes)
    tell_cycles(place.material)
    source = grating.frame_source()
    bare = [f"{each.name}: no UV map, so no direction for the grating; {DIRECTION_REMEDY}"
            for each in meshes if not has_uv_map(each.data, source)]  # fmt: skip
    warnings = [*bare, *prepared(meshes, grating), *further(scene, grating), *overfull([place.material])]
    return [f"{grating.name}: added to {place.material.name}; link its Shader output", *warnings]


def add_preset_node(scene: bpy.types.Scene, preset: str, place: Place) -> list[str]:
    """Add a preset to the scene's gratings, baked at draft quality if no draft ships, and its Diffraction group.
    Returns lines to report. Raises GratingError, with nothing added, for an unknown preset or a faulty file, or if the
    material cannot be changed."""
    check_can_change(place.material)
    line = import_preset(scene, preset)
    grating = active_grating(scene)
    if not grating.bake_path:
        bake_and_wait(grating)
    added, *warnings = add_grating_node(scene, "", place)
    return [added, line, *warnings]


def add_pattern_node(scene: bpy.types.Scene, pattern: str, place: Place) -> list[str]:
    """Add the node of a hologram's pattern, with a UV Map node, and fit its cells to a mesh with the material. Returns
    lines to report. Raises GratingError, with nothing added, if the material cannot be changed."""
    check_can_change(place.material)
    _deselect(place.tree)
    node = add_pattern(place.tree, pattern_group(pattern), place.location)
    place.tree.nodes.active = node
    fit_pattern(node, _meshes_with(scene, place.material))
    return [f"{LABELS[pattern]}: added to {place.material.name}; link its outputs to a Diffraction node"]


def _deselect(tree: bpy.types.NodeTree) -> None:
    """Deselect a tree's nodes, so that the new ones, which Blender selects, are the only selected ones."""
    for node in tree.nodes:
        node.select = False


def _grating(scene: bpy.types.Scene, name: str) -> Grating:
    """The scene's grating with a name, the active one if it is empty. Raises GratingError if there is none."""
    if not name:
        return active_grating(scene)
    for grating in scene.natural_gratings.items:
        if grating.name == name:
            return grating
    raise GratingError(name, f"no such grating in scene {scene.name}", "choose one of the list in the Grating panel")


def _meshes_with(scene: bpy.types.Scene, material: bpy.types.Material) -> list[bpy.types.Object]:
    """The scene's meshes with a material that are not in Edit Mode, where UV maps cannot be read."""
    meshes = (thing for thing in scene.objects if thing.type == "MESH" and not thing.data.is_editmode)
    return [mesh for mesh in meshes if any(slot.material == material for slot in mesh.material_slots)]
