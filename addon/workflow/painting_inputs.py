# SPDX-License-Identifier: GPL-3.0-or-later
"""Painting an input of a grating's material: its strength, its direction or its period, from place to place."""

import bpy
import numpy as np

from ...precompute.base.failure import GratingError, printable
from ..blender import compat
from ..gratings.grating import Grating, active_grating
from ..materials.group_properties import RANGES, paint_of, put_paint, remove_paint
from ..materials.holograms.hologram_nodes import input_set_by_artist
from ..materials.material import check_can_add, diffraction_nodes
from .chosen_meshes import check_can_change, check_not_edited, data_is_fixed

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
