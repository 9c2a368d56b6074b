# SPDX-License-Identifier: GPL-3.0-or-later
"""Putting a grating on meshes: as their material, or over the materials that they have."""

import bpy

from ...precompute.base.failure import GratingError
from ..materials.material import add_diffraction
from ..scene.gratings import active_grating
from .material import group_of, make_material


def add_to_meshes(scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> str:
    """Lay diffraction over the active materials of the meshes among the objects; one line of what was done.

    Raises GratingError, with nothing changed, if a mesh has no material or no direction for the grating, or the bake
    or all lamps are missing."""
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
    """Put the active grating's material on the meshes among the objects; one line of what was done.

    Raises GratingError, with nothing assigned, if a mesh has no direction for the grating, or the bake or all lamps
    are missing."""
    meshes = meshes_among(scene, objects)
    grating = active_grating(scene)
    group_of(scene, grating)
    material = grating.material or make_material(scene, grating)
    for mesh in meshes:
        put_material(mesh, material)
    return f"{material.name}: on {', '.join(o.name for o in meshes)}"


def meshes_among(scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> list[bpy.types.Object]:
    """The meshes, each with a direction for the grating. Raises GratingError if one has none, or there is none."""
    meshes = [o for o in objects if o.type == "MESH"]
    if not meshes:
        raise GratingError(f"scene {scene.name}: no mesh is selected; select one or name it")
    for mesh in meshes:
        check_frame(mesh)
    return meshes


def check_frame(mesh: bpy.types.Object) -> None:
    """Raises GratingError unless the mesh has a UV map, whose U is the grating's direction."""
    if not mesh.data.uv_layers:
        raise GratingError(f"{mesh.name}: no UV map, so no direction for the grating; unwrap it, U along the body")
    if not mesh.data.polygons:
        raise GratingError(f"{mesh.name}: no faces to put a material on; choose a mesh with faces")


def put_material(mesh: bpy.types.Object, material: bpy.types.Material) -> None:
    """The object's active slot, made if it has none."""
    if mesh.material_slots:
        mesh.material_slots[mesh.active_material_index].material = material
    else:
        mesh.data.materials.append(material)
