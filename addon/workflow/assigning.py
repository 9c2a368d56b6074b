# SPDX-License-Identifier: GPL-3.0-or-later
"""Assigning a grating to meshes: as their material, or layered over the materials that they have.

Each action returns lines to report: what was done, then warnings. Blender's status bar keeps the last line."""

import bpy

from ...precompute.base.failure import GratingError
from ..direction.seams import seam_warning
from ..gratings.grating import Grating, active_grating
from ..materials.lost_parts import lost
from ..materials.material import add_diffraction, check_can_add, diffraction_nodes, empty_nodes, overfull
from ..materials.skin import crowded
from .adding_holograms import fit_hologram
from .chosen_meshes import meshes_among, no_meshes, slots_with_faces
from .fitting_worlds import want_fit
from .making_materials import beginning_of, group_of, lamps_alone, working_material
from .material_slots import Selection, note_replaced
from .noticing_outside import notice_outside
from .reflections import dull
from .varying import prepare_meshes


def assign_to_meshes(scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> list[str]:
    """Put the active grating's material into the active slot of the meshes among the objects. Raises GratingError, with
    nothing assigned, if a mesh has no UV map, is in Edit Mode or is linked, or if there is no bake."""
    grating = active_grating(scene)
    meshes = meshes_among(scene, objects, grating.frame_source())
    seams = _seams(objects, meshes, grating)
    former, material = grating.material, working_material(scene, grating)
    if material != former:
        fit_hologram(diffraction_nodes(material), meshes)
    selection = Selection(objects)
    kept = [line for mesh in meshes if (line := _put_in_active_slot(selection, mesh, material))]
    return [
        f"{material.name}: on {_names(meshes)}",
        *seams,
        *prepared(meshes, grating),
        *kept,
        *further(scene, grating),
    ]


def add_to_meshes(scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> list[str]:
    """Add diffraction to all materials that the faces of the meshes among the objects show. In materials without
    diffraction, the new nodes begin as the grating's look says. Raises GratingError, with nothing changed, if there is
    no bake, the look is damaged, a material cannot be changed, or a mesh is linked or lacks a material or a UV map."""
    grating = active_grating(scene)
    meshes = meshes_among(scene, objects, grating.frame_source())
    materials: dict[bpy.types.Material, None] = {}
    bare = []
    for mesh in meshes:
        shown = [slot.material for slot in slots_with_faces(mesh)]
        if not any(shown):
            raise GratingError(mesh.name, "no material to add diffraction to", "use Assign to Selected")
        if None in shown:
            bare.append(f"{mesh.name}: faces of an empty material slot have no diffraction; give the slot a material")
        materials.update(dict.fromkeys(filter(None, shown)))
    for material in materials:
        check_can_add(material)
    seams, begin = _seams(objects, meshes, grating), beginning_of(grating)
    group = group_of(scene, grating)
    for material in materials:
        is_first = not (diffraction_nodes(material) or empty_nodes(material))
        add_diffraction(material, group)
        if is_first:  # what an artist chose since then stays
            begin(diffraction_nodes(material))
            fit_hologram(diffraction_nodes(material), [mesh for mesh in meshes if _shows(mesh, material)])
    lines = [*seams, *prepared(meshes, grating), *bare, *further(scene, grating), *overfull(materials)]
    return [f"{grating.name}: added to {_names(materials)}", *lines]


def _shows(mesh: bpy.types.Object, material: bpy.types.Material) -> bool:
    return any(slot.material == material for slot in slots_with_faces(mesh))


def further(scene: bpy.types.Scene, grating: Grating) -> list[str]:
    """Fit the world's sources if a material uses them. Returns warnings: the fit failed, the scene shows directions
    that a bake does not hold, EEVEE has no room for all lamps and sources of the grating, or it looks dark because it
    has little to reflect."""
    failed = []
    try:
        want_fit(scene)
    except GratingError as error:
        failed = [str(error)]
    return [*failed, *notice_outside(scene), *crowded(grating.group), *dull(scene, grating)]


def _put_in_active_slot(selection: Selection, mesh: bpy.types.Object, material: bpy.types.Material) -> str:
    """Put the material into the mesh's active slot, made if missing. Returns a warning if the mesh has other slots."""
    if not mesh.material_slots:
        mesh.data.materials.append(None)
    index, count = mesh.active_material_index, len(mesh.material_slots)
    before = mesh.material_slots[index].material
    if before == material:
        return ""
    note_replaced(mesh, index)
    selection.put(mesh, index, material)
    if count == 1:
        return ""
    name = "empty" if before is None else before.name
    return f"{mesh.name}: only slot {index + 1} of {count} ({name}) was replaced; Add to Materials changes all slots"


def _seams(objects: list[bpy.types.Object], meshes: list[bpy.types.Object], grating: Grating) -> list[str]:
    """Warnings about meshes whose UV islands rotate the direction, and about left-out objects. Called before any
    change."""
    source = grating.frame_source()
    return [line for mesh in meshes if (line := seam_warning(mesh, source))] + no_meshes(objects)


def prepared(meshes: list[bpy.types.Object], grating: Grating) -> list[str]:
    """Store on the meshes what the grating's variation needs. Returns warnings."""
    lines = prepare_meshes(grating.group, meshes) + lamps_alone(grating) + lost([grating.group])
    if grating.frame_source().kind != grating.frame_kind:
        lines.append(
            f"{grating.name}: its direction map was deleted, so it follows the UV map; choose its Direction again"
        )
    return lines


def _names(things) -> str:
    return ", ".join(thing.name for thing in things)
