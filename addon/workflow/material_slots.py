# SPDX-License-Identifier: GPL-3.0-or-later
"""Putting materials into slots of selected objects, without changing other objects, and so that it can be undone."""

import bpy

from ..blender import stored
from ..gratings.own_names import is_own
from ..gratings.replaced_material import FREE, replaced_on
from .chosen_meshes import data_is_fixed


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
    # Earlier versions did not mark the materials.
    of_gratings = {grating.material for grating in items if grating.material is not None}
    return of_gratings | {material for material in bpy.data.materials if is_own(material)}


def note_replaced(thing: bpy.types.Object, index: int) -> None:
    """Before a grating's own material replaces a slot's material, record the former material on the object."""
    material = thing.material_slots[index].material
    if material not in own_materials():
        take_replaced(thing, index)
        former = next((each for each in replaced_on(thing) if each.slot == FREE), None) or replaced_on(thing).add()
        former.slot, former.material = index, material


def was_replaced(thing: bpy.types.Object, index: int) -> bool:
    """Whether the slot shows a grating's own material and its former material is recorded."""
    is_noted = _replaced(index) in thing or any(each.slot == index for each in replaced_on(thing))
    return is_noted and thing.material_slots[index].material in own_materials()


def take_replaced(thing: bpy.types.Object, index: int) -> bpy.types.Material | None:
    """Remove and return the record of a slot's former material; None if the slot was empty or the material is gone."""
    material = stored.block(thing, _replaced(index), bpy.types.Material)
    thing.pop(_replaced(index), None)
    for former in replaced_on(thing):
        if former.slot == index:
            material = former.material
            former.slot, former.material = FREE, None
    return material


def _replaced(index: int) -> str:
    """The object's custom property that recorded a slot's former material in earlier versions."""
    return f"ng_replaced_{index}"
