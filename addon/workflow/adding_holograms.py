# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding a hologram to diffraction materials: a pattern of directions, periods and strengths."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import bpy

from ...precompute.base.failure import GratingError
from ..direction.uv_aspect import uv_aspect
from ..gratings.bakes import noted_region
from ..gratings.direction_source import KINDS, STORED, UV_MAP
from ..gratings.wording import translated
from ..materials.group_properties import frame_of
from ..materials.holograms.hologram_nodes import (
    hologram_of,
    load_picture,
    pattern_group,
    pattern_of,
    put_hologram,
    remove_hologram,
)
from ..materials.holograms.patterns import ASPECT, LABELS, NONE, PICTURE, SUNBURST
from ..materials.material import check_can_add, diffraction_nodes, materials_with, overfull, shown_by
from ..materials.response import PERIOD_SCALE, responses_in
from .chosen_meshes import check_not_edited

# Marks a material whose hologram was not fitted to a mesh, by a custom property.
_UNFITTED = "ng_unfitted_hologram"


@dataclass(frozen=True)
class Hologram:
    """A chosen hologram.

    pattern  one of PATTERNS (materials/holograms/patterns.py)
    values   numbers for inputs of the pattern, by name
    picture  of PICTURE: the file
    uv_map   name of the UV map that the pattern follows; empty for the map that renders"""

    pattern: str
    values: Mapping[str, float] = field(default_factory=dict)
    picture: str = ""
    uv_map: str = ""


def add_hologram(scene: bpy.types.Scene, objects: Iterable[bpy.types.Object], choice: Hologram) -> list[str]:
    """Put a hologram, or with the pattern NONE no hologram, into the diffraction materials of the meshes among the
    objects; if they have none, into all materials of the active grating. Returns lines to report. Raises GratingError,
    with nothing changed, if there is no such material, if one is linked, if no mesh has the UV map, or if the picture
    cannot be read."""
    meshes = [thing for thing in objects if thing.type == "MESH" and _materials_of(thing)]
    materials = list(dict.fromkeys(material for mesh in meshes for material in _materials_of(mesh)))
    if not materials:
        meshes, materials = _of_active(scene)
    nodes = [node for material in materials for node in diffraction_nodes(material)]
    for material in materials:
        check_can_add(material)
    for tree in dict.fromkeys(node.id_data for node in nodes):
        if tree.library is not None:
            raise GratingError(tree.name, f"linked from {tree.library.filepath}", "make it local first")
    names = ", ".join(material.name for material in materials)
    if choice.pattern == NONE:
        had = [node for node in nodes if hologram_of(node) is not None]
        for node in had:
            remove_hologram(node)
        return [f"{names}: {'hologram removed' if had else 'has no hologram'}"]
    mapped = _with_uv_map(meshes, choice.uv_map)
    image = load_picture(choice.picture) if choice.pattern == PICTURE else None
    group = pattern_group(choice.pattern, image)
    values = {ASPECT.name: uv_aspect(mapped[0], choice.uv_map), **choice.values}
    for node in nodes:
        put_hologram(node, group, values, uv_map=choice.uv_map)
    bare = [f"{mesh.name}: has no UV map for the hologram; it shows one cell" for mesh in meshes if mesh not in mapped]
    return [f"{names}: {LABELS[choice.pattern]}", *bare, *_limits(nodes, choice.pattern), *overfull(materials)]


def hologram_summary(group: bpy.types.NodeTree) -> str:
    """The labels of the patterns in the materials with a Diffraction group."""
    nodes = [node for material in materials_with(group) for node in diffraction_nodes(material)]
    patterns = (hologram_of(node) for node in nodes if node.node_tree == group)
    labels = dict.fromkeys(LABELS[pattern_of(each.node_tree)] for each in patterns if each is not None)
    first, *others = map(translated, labels or [LABELS[NONE]])
    for each in others:
        first = translated("{names} and {last}", names=first, last=each)
    return first


def fit_hologram(nodes: Iterable[bpy.types.Node], meshes: Iterable[bpy.types.Object]) -> None:
    """Fit the cells of new Diffraction nodes' hologram to the shape of the first mesh's UV map."""
    things = list(meshes)
    for node in nodes:
        pattern = hologram_of(node)
        if pattern is not None:
            fit_pattern(pattern, things)


def fit_pattern(pattern: bpy.types.Node, meshes: Iterable[bpy.types.Object]) -> None:
    """Fit the cells of a pattern's node to the shape of the first mesh's UV map."""
    mapped = next((mesh for mesh in meshes if mesh.data.uv_layers), None)
    if mapped is not None:
        pattern.inputs[ASPECT.name].default_value = uv_aspect(mapped)


def fit_hologram_later(material: bpy.types.Material) -> None:
    """Mark a material of an asset library, which has no mesh yet, so that its hologram is fitted when it is adopted."""
    if any(hologram_of(node) is not None for node in diffraction_nodes(material)):
        material[_UNFITTED] = True


def fit_adopted_hologram(material: bpy.types.Material) -> None:
    """Fit the hologram of a marked material to the first mesh with it that is not in Edit Mode, if there is one."""
    if not material.get(_UNFITTED):
        return
    things = (thing for thing in bpy.data.objects if thing.type == "MESH" and not thing.data.is_editmode)
    meshes = [thing for thing in things if thing.data.uv_layers and material in _materials_of(thing)]
    if meshes:
        fit_hologram(diffraction_nodes(material), meshes)
        del material[_UNFITTED]


def _materials_of(thing: bpy.types.Object) -> list[bpy.types.Material]:
    """The diffraction materials in an object's slots."""
    return [slot.material for slot in thing.material_slots if diffraction_nodes(slot.material)]


def _of_active(scene: bpy.types.Scene) -> tuple[list[bpy.types.Object], list[bpy.types.Material]]:
    """The meshes that show the active grating, and all its materials."""
    grating = scene.natural_gratings.active()
    materials = [] if grating is None or grating.group is None else materials_with(grating.group)
    if not materials:
        what = f"scene {scene.name}" if grating is None else grating.name
        raise GratingError(what, "no mesh shows it yet", "press Assign to Selected first")
    return [thing for thing in shown_by(grating.group) if thing.type == "MESH"], materials


def _with_uv_map(meshes: list[bpy.types.Object], uv_map: str) -> list[bpy.types.Object]:
    """The meshes with the UV map that a pattern follows. Raises GratingError if no mesh has it."""
    for mesh in meshes:
        check_not_edited(mesh)
    mapped = [m for m in meshes if (uv_map in m.data.uv_layers if uv_map else len(m.data.uv_layers) > 0)]
    if not mapped:
        what = meshes[0].name if meshes else "hologram"
        fault = " ".join(filter(None, ("no UV map", uv_map, "for the pattern")))
        raise GratingError(what, fault, "unwrap the mesh, or press Unwrap")
    return mapped


def _limits(nodes: Iterable[bpy.types.Node], pattern: str) -> list[str]:
    """A line for each Diffraction group that does not follow all of a pattern."""
    lines = []
    for group in dict.fromkeys(node.node_tree for node in nodes):
        if any(PERIOD_SCALE not in response.inputs for response in responses_in(group)):
            lines.append(f"{group.name}: its method has no Period Scale, so the hologram's periods have no effect")
        if any(noted_region(response.group) is not None for response in responses_in(group)):
            lines.append(
                f"{group.name}: baked for one scene before it had this pattern, so parts may be black; press Bake for "
                "This Scene again"
            )
        source = frame_of(group)
        is_along_u = source.kind == UV_MAP or (source.kind == STORED and not source.combed)
        if pattern == SUNBURST and not is_along_u:
            label = next(label for kind, label, _ in KINDS if kind == source.kind)
            lines.append(f"{group.name}: rings and rays need the Direction UV Map; with {label} they are turned")
    return lines
