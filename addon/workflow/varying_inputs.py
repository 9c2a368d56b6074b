# SPDX-License-Identifier: GPL-3.0-or-later
"""Varying inputs of diffraction materials from place to place: directions, periods and strengths by a hologram's
pattern, and one of them by paint."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import bpy
import numpy as np

from ...precompute.base.failure import GratingError, printable
from ..blender import compat
from ..direction.uv_maps import uv_aspect
from ..gratings.bakes import noted_region
from ..gratings.direction_source import KINDS, STORED, UV_MAP
from ..gratings.grating import Grating, active_grating
from ..gratings.wording import translated
from ..materials.group_properties import RANGES, frame_of, paint_of, put_paint, remove_paint
from ..materials.holograms.hologram_nodes import (
    hologram_of,
    input_set_by_artist,
    load_picture,
    pattern_group,
    pattern_of,
    put_hologram,
    remove_hologram,
)
from ..materials.holograms.patterns import ASPECT, LABELS, NONE, PICTURE, SUNBURST
from ..materials.material import check_can_add, diffraction_nodes, materials_with, overfull, shown_by
from ..materials.response import PERIOD_SCALE, responses_in
from .chosen_meshes import check_can_change, check_not_edited, data_is_fixed

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


ATTRIBUTE, TEXTURE, GROUP = "ATTRIBUTE", "TEXTURE", "GROUP"
_SIDE = 1024
# The mask where nothing is painted yet: the whole strength, no turn, and a period scale of 1 between the range's ends.
_LOW, _HIGH = RANGES["Period Scale"]
_CLEAN = {"Strength": 1.0, "Rotation": 0.5, "Period Scale": (1.0 - _LOW) / ((_HIGH or 1.0) - _LOW)}


def paint_input(
    scene: bpy.types.Scene, thing: bpy.types.Object | None, name: str, *, by: str, source: str = ""
) -> list[str]:  # fmt: skip
    """Let a mask set an input of the material with the active grating on a mesh, by a colour attribute, a texture or a
    vertex group. `source` names a texture or a vertex group that exists; without it a clean mask is made, as colour
    attributes and vertex groups on all meshes with the material. What is painted already stays. Returns lines to
    report. Raises GratingError, with nothing changed, if the mesh does not show the grating, is edited or cannot be
    changed, if other nodes set the input, if the source is missing, or if a texture has no UV map."""
    grating = active_grating(scene)
    mesh, socket = _painted(grating, thing, name)
    if paint_of(socket) is not None:
        return [f"{mesh.name}: {name} is painted already; go on painting"]
    if socket.is_linked:
        raise GratingError(mesh.name, f"nodes set its {name}", "unlink the input in the material first")
    mask, clean = f"{grating.name} {name}", _CLEAN[name]
    if by == TEXTURE:
        if not mesh.data.uv_layers:
            raise GratingError(mesh.name, "no UV map for a texture", "unwrap it, or paint a colour attribute")
        image = _known(bpy.data.images, source, "picture in the file") if source else _texture(mask, clean)
        put_paint(socket, image)
        return [f"{mesh.name}: paint {name} in Texture Paint mode", *_not_data(image)]
    if source and by == GROUP:
        _known(mesh.vertex_groups, source, f"vertex group on {mesh.name}")
        put_paint(socket, source)
        mesh.vertex_groups.active_index = mesh.vertex_groups[source].index
        bare = [each.name for each in _sharing(mesh) if source not in each.vertex_groups]
        lacking = [f"{', '.join(bare)}: no vertex group {source}, so the mask is black there"] if bare else []
        return [f"{mesh.name}: paint {name} in Weight Paint mode", *_not_seen(), *lacking]
    others = _sharing(mesh)
    for other in others:
        check_can_change(other)
        check_not_edited(other)
        if data_is_fixed(other):
            raise GratingError(other.data.name, "its mesh is linked from another file", "paint a texture")
    if by == GROUP:
        mask = f"{mask} Weight"  # an attribute and a group of one name would hide each other
        for other in others:
            _group(other, mask, clean)
    else:
        for data in dict.fromkeys(other.data for other in others):
            _attribute(data, mask, clean)
    put_paint(socket, mask)
    if by == GROUP:
        return [f"{mesh.name}: paint {name} in Weight Paint mode", *_not_seen()]
    return [f"{mesh.name}: paint {name} in Vertex Paint mode"]


def unpaint_input(scene: bpy.types.Scene, thing: bpy.types.Object | None, name: str) -> list[str]:
    """Give a painted input its number back. The attribute or the texture stays. Raises GratingError if it is not
    painted, or as paint_input does."""
    mesh, socket = _painted(active_grating(scene), thing, name)
    if paint_of(socket) is None:
        raise GratingError(mesh.name, f"its {name} is not painted", "paint it first")
    remove_paint(socket)
    return [f"{mesh.name}: {name} has its number again"]


def _painted(
    grating: Grating, thing: bpy.types.Object | None, name: str
) -> tuple[bpy.types.Object, bpy.types.NodeSocket]:
    """The mesh, and the input of its active material's Diffraction node. Raises GratingError as paint_input does."""
    if thing is None or thing.type != "MESH":
        raise GratingError(grating.name, "no mesh is active", "click a mesh that shows it")
    check_can_change(thing)
    check_not_edited(thing)
    material = thing.active_material
    nodes = [node for node in diffraction_nodes(material) if node.node_tree == grating.group]
    if material is None or not nodes:
        raise GratingError(thing.name, f"its active material does not show {grating.name}", "press Assign to Selected")
    check_can_add(material)
    tree = nodes[0].id_data
    if tree.library is not None:
        raise GratingError(tree.name, f"linked from {tree.library.filepath}", "make it local first")
    if name not in nodes[0].inputs:
        raise GratingError(material.name, f"its Diffraction node lost the input {name}", "press Mend Materials")
    return thing, input_set_by_artist(nodes[0], name)


def _known(collection, name: str, what: str):
    """A data-block or a vertex group by its name. Raises GratingError if there is none."""
    if name not in collection:
        raise GratingError(printable(name), f"no such {what}", "choose another, or leave the field empty")
    return collection[name]


def _not_data(image: bpy.types.Image) -> list[str]:
    """A warning if Blender converts the numbers of a texture, as it does for colours."""
    if image.colorspace_settings.is_data:
        return []
    return [f"{image.name}: a texture of colours, so a painted 50 % is read as less; set its Color Space to Non-Color"]


def _not_seen() -> list[str]:
    """A warning if EEVEE does not read vertex groups."""
    if compat.EEVEE_READS_VERTEX_GROUPS:
        return []
    return ["EEVEE of this Blender reads no vertex groups, so the mask is black there; paint vertices for EEVEE"]


def _sharing(mesh: bpy.types.Object) -> list[bpy.types.Object]:
    """The meshes of the file with the active material of a mesh."""
    return [each for each in bpy.data.objects if each.type == "MESH" and mesh.active_material in _materials(each)]


def _materials(thing: bpy.types.Object) -> list[bpy.types.Material | None]:
    return [slot.material for slot in thing.material_slots]


def _attribute(mesh: bpy.types.Mesh, name: str, clean: float) -> None:
    """Make a colour attribute the one that is painted. A new one is clean."""
    attribute = mesh.color_attributes.get(name)
    if attribute is None:
        attribute = mesh.color_attributes.new(name, "FLOAT_COLOR", "POINT")
        values = np.tile(np.array([clean, clean, clean, 1.0], np.float32), len(mesh.vertices))
        attribute.data.foreach_set("color", values)
    mesh.color_attributes.active_color = attribute


def _group(thing: bpy.types.Object, name: str, clean: float) -> None:
    """Make a vertex group the one that is painted. A new one is clean."""
    group = thing.vertex_groups.get(name)
    if group is None:
        group = thing.vertex_groups.new(name=name)
        group.add(range(len(thing.data.vertices)), clean, "REPLACE")
    thing.vertex_groups.active_index = group.index


def _texture(name: str, clean: float) -> bpy.types.Image:
    """A clean texture of numbers, packed so that the file keeps it."""
    image = bpy.data.images.new(name, _SIDE, _SIDE, is_data=True)
    image.pixels.foreach_set(np.tile(np.array([clean, clean, clean, 1.0], np.float32), _SIDE * _SIDE))
    image.pack()
    return image
