# SPDX-License-Identifier: GPL-3.0-or-later
"""Assigning a grating to meshes, as their material or layered over the materials that they have, and removing it. Undo
takes this back, and other objects stay unchanged.

Each action returns lines to report: what was done, then warnings. Blender's status bar keeps the last line."""

import bpy

from ...precompute.base.failure import GratingError
from ..direction.seams import seam_warning
from ..gratings.grating import Grating, active_grating
from ..gratings.own_names import is_own
from ..gratings.replaced_material import FREE, replaced_on
from ..materials.lost_parts import lost
from ..materials.material import (
    add_diffraction,
    check_can_add,
    diffraction_nodes,
    empty_nodes,
    overfull,
    remove_diffraction,
)
from ..materials.skin import warnings_of
from .chosen_meshes import check_can_change, data_is_fixed, meshes_among, no_meshes, slots_with_faces
from .finding_bakes import notice_outside
from .lights.fitting_worlds import forget_unread_sources, want_fit
from .lights.reflections import dull
from .making_materials import beginning_of, group_of, lamps_alone, prepare_meshes, working_material
from .varying_inputs import fit_hologram


class Selection:
    """The objects that an artist works on, and the data and materials that other objects share with them."""

    def __init__(self, objects: list[bpy.types.Object]) -> None:
        selected = set(objects)
        others = [o for o in bpy.data.objects if o not in selected]
        self._data = {o.data for o in others if o.data is not None}
        # A grating's own material stays unchanged, for the next object.
        kept = own_materials()
        self._materials = kept | {slot.material for o in others for slot in o.material_slots}

    def has_alone(self, material: bpy.types.Material) -> bool:
        """Whether no other object and no grating uses the material."""
        return material not in self._materials

    def put(self, thing: bpy.types.Object, index: int, material: bpy.types.Material | None) -> None:
        """Put a material into one of the object's slots. If the mesh is linked from another file, or shared with an
        object that is not selected, the slot is switched from the mesh to the object."""
        slot = thing.material_slots[index]
        if slot.link == "DATA" and (thing.data in self._data or data_is_fixed(thing)):
            slot.link = "OBJECT"
        slot.material = material


def own_materials() -> set[bpy.types.Material]:
    """The materials that were made for gratings."""
    items = (grating for scene in bpy.data.scenes for grating in scene.natural_gratings.items)
    renamed = {grating.material for grating in items if grating.material is not None}
    return renamed | {material for material in bpy.data.materials if is_own(material)}


def note_replaced(thing: bpy.types.Object, index: int) -> None:
    """Before a grating's own material replaces a slot's material, record the former material on the object."""
    material = thing.material_slots[index].material
    if material not in own_materials():
        take_replaced(thing, index)
        former = next((each for each in replaced_on(thing) if each.slot == FREE), None) or replaced_on(thing).add()
        former.slot, former.material = index, material


def was_replaced(thing: bpy.types.Object, index: int) -> bool:
    """Whether the slot shows a grating's own material and its former material is recorded."""
    is_noted = any(each.slot == index for each in replaced_on(thing))
    return is_noted and thing.material_slots[index].material in own_materials()


def take_replaced(thing: bpy.types.Object, index: int) -> bpy.types.Material | None:
    """Remove and return the record of a slot's former material; None if the slot was empty or the material is gone."""
    material = None
    for former in replaced_on(thing):
        if former.slot == index:
            material = former.material
            former.slot, former.material = FREE, None
    return material


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
    return [*failed, *notice_outside(scene), *warnings_of(grating.group), *dull(scene, grating)]


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


def remove_from(objects: list[bpy.types.Object]) -> str:
    """Remove diffraction from all materials of the objects, and from no other object. Returns a line to report.

    A slot with a grating's own material gets its former material back. Any other material loses its diffraction. If
    something else uses that material too, the objects get a copy without diffraction. The sources of worlds go with the
    last material that reads them.

    Raises GratingError, with nothing changed, if an object is linked from another file."""
    found = [(o, index) for o in objects for index in slots_with_diffraction(o)]
    for thing in dict.fromkeys(thing for thing, _ in found):
        check_can_change(thing)
    selection = Selection(objects)
    # Maps a material with diffraction to the copy without.
    plain: dict[bpy.types.Material, bpy.types.Material] = {}
    lines = []
    for thing, index in found:
        material = thing.material_slots[index].material
        if not diffraction_nodes(material):
            continue  # already done through an object that shares the material or the mesh
        if was_replaced(thing, index):
            former = take_replaced(thing, index)
            selection.put(thing, index, former)
            lines.append(f"{thing.name}: {f'{former.name} is back' if former else 'its slot is empty again'}")
        elif selection.has_alone(material) and material.library is None and material.override_library is None:
            remove_diffraction(material)
            lines.append(f"{material.name}: without diffraction")
        else:
            if material not in plain:
                plain[material] = material.copy()
                remove_diffraction(plain[material])
                lines.append(f"other objects keep {material.name}; here it is {plain[material].name}")
            selection.put(thing, index, plain[material])
    forget_unread_sources()
    return "; ".join(lines)


def slots_with_diffraction(thing: bpy.types.Object) -> list[int]:
    """The indices of the object's slots whose material has diffraction."""
    return [index for index, slot in enumerate(thing.material_slots) if diffraction_nodes(slot.material)]
