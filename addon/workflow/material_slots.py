# SPDX-License-Identifier: GPL-3.0-or-later
"""Putting materials into the slots of selected objects, so that no other object changes, and so that it can be taken
back."""

import bpy

from ..blender import stored
from ..gratings.own_names import is_own
from .chosen_meshes import data_is_fixed


class Selection:
    """The objects that an artist works on, and what other objects share with them."""

    def __init__(self, objects: list[bpy.types.Object]) -> None:
        selected = set(objects)
        others = [o for o in bpy.data.objects if o not in selected]
        self._data = {o.data for o in others if o.data is not None}
        # A grating's own material stays as it is, for the next object.
        kept = own_materials()
        self._materials = kept | {slot.material for o in others for slot in o.material_slots}

    def has_alone(self, material: bpy.types.Material) -> bool:
        """Whether no other object and no grating has the material."""
        return material not in self._materials

    def put(self, thing: bpy.types.Object, index: int, material: bpy.types.Material | None) -> None:
        """Put a material into one of the object's slots. Where the object shares its mesh with an object that is not
        selected, or has it from another file, the slot becomes the object's own."""
        slot = thing.material_slots[index]
        if slot.link == "DATA" and (thing.data in self._data or data_is_fixed(thing)):
            slot.link = "OBJECT"
        slot.material = material


def own_materials() -> set[bpy.types.Material]:
    """The materials that were made from gratings."""
    items = (grating for scene in bpy.data.scenes for grating in scene.natural_gratings.items)
    # Earlier versions noted nothing.
    of_gratings = {grating.material for grating in items if grating.material is not None}
    return of_gratings | {material for material in bpy.data.materials if is_own(material)}


def note_replaced(thing: bpy.types.Object, index: int) -> None:
    """Note on the object which material a grating's own material is about to replace in a slot."""
    material = thing.material_slots[index].material
    if material not in own_materials():
        thing[_replaced(index)] = "" if material is None else material


def was_replaced(thing: bpy.types.Object, index: int) -> bool:
    """Whether the slot shows a grating's own material in place of a material that was noted."""
    return _replaced(index) in thing and thing.material_slots[index].material in own_materials()


def take_replaced(thing: bpy.types.Object, index: int) -> bpy.types.Material | None:
    """The material that was noted for a slot, None for an empty slot or a deleted material; the note is removed."""
    material = stored.block(thing, _replaced(index), bpy.types.Material)
    del thing[_replaced(index)]
    return material


def _replaced(index: int) -> str:
    """The custom property of an object that holds the material which a slot had before a grating's own."""
    return f"ng_replaced_{index}"
