# SPDX-License-Identifier: GPL-3.0-or-later
"""Putting a grating on meshes, as their material or over the materials that they have, and taking it off."""

import bpy

from ...precompute.base.failure import GratingError
from ..materials.material import add_diffraction, diffraction_nodes, remove_diffraction
from ..scene.gratings import active_grating
from .material import group_of, make_material


def add_to_meshes(scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> str:
    """Lay diffraction over the active materials of the meshes among the objects; one line on what was done.

    Raises GratingError, with nothing changed, if a mesh has no material or no UV map, or if there is no bake or no
    lamp."""
    meshes = meshes_among(scene, objects)
    for mesh in meshes:
        if mesh.active_material is None:
            raise GratingError(f"{mesh.name}: no material to add diffraction to; use Assign to Selected")
    materials = list(dict.fromkeys(mesh.active_material for mesh in meshes))
    grating = active_grating(scene)
    group = group_of(scene, grating)
    for material in materials:
        add_diffraction(material, group)
    return f"{grating.name}: over {', '.join(material.name for material in materials)}"


def assign_to_meshes(scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> str:
    """Put the active grating's material on the meshes among the objects; one line on what was done.

    Raises GratingError, with nothing assigned, if a mesh has no UV map, or if there is no bake or no lamp."""
    meshes = meshes_among(scene, objects)
    grating = active_grating(scene)
    group_of(scene, grating)
    material = grating.material or make_material(scene, grating)
    for mesh in meshes:
        put_material(mesh, material)
    return f"{material.name}: on {', '.join(o.name for o in meshes)}"


def remove_from(objects: list[bpy.types.Object]) -> str:
    """Remove diffraction from the objects' active materials; returns one line on what was done.

    Materials that are linked from another file stay as they are."""
    changed = [m for m in materials_with_diffraction(objects) if m.library is None]
    for material in changed:
        remove_diffraction(material)
    return f"removed from {', '.join(material.name for material in changed) or 'none: linked'}"


def materials_with_diffraction(objects: list[bpy.types.Object]) -> list[bpy.types.Material]:
    """The objects' active materials that have diffraction, each once."""
    materials = dict.fromkeys(o.active_material for o in objects if o.active_material is not None)
    return [material for material in materials if diffraction_nodes(material)]


def meshes_among(scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> list[bpy.types.Object]:
    """The meshes among the objects. Raises GratingError if there is none, or if one cannot carry a grating."""
    meshes = [o for o in objects if o.type == "MESH"]
    if not meshes:
        raise GratingError(f"scene {scene.name}: no mesh is selected; select one or name it")
    for mesh in meshes:
        check_frame(mesh)
    return meshes


def check_frame(mesh: bpy.types.Object) -> None:
    """Raise GratingError unless the mesh has faces and a UV map, whose U is the direction of the scan's columns."""
    if not mesh.data.uv_layers:
        raise GratingError(f"{mesh.name}: no UV map, so no direction for the grating; unwrap it, U along the body")
    if not mesh.data.polygons:
        raise GratingError(f"{mesh.name}: no faces to put a material on; choose a mesh with faces")


def put_material(mesh: bpy.types.Object, material: bpy.types.Material) -> None:
    """Put a material into the object's active slot; the slot is made if there is none."""
    if mesh.material_slots:
        mesh.material_slots[mesh.active_material_index].material = material
    else:
        mesh.data.materials.append(material)
