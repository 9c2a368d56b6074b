# SPDX-License-Identifier: GPL-3.0-or-later
"""Taking diffraction off objects, and off no others."""

import bpy

from ..materials.material import diffraction_nodes, remove_diffraction
from .chosen_meshes import check_can_change
from .material_slots import Selection, take_replaced, was_replaced


def remove_from(objects: list[bpy.types.Object]) -> str:
    """Remove diffraction from all materials of the objects; one line on what was done. No other object changes.

    A slot that a grating's own material took is given its former material back. Any other material loses its
    diffraction, and where something else has the material too, the objects get a copy of it without diffraction.

    Raises GratingError, with nothing changed, if an object is another file's."""
    found = [(o, index) for o in objects for index in slots_with_diffraction(o)]
    for thing in dict.fromkeys(thing for thing, _ in found):
        check_can_change(thing)
    selection = Selection(objects)
    # By the material with diffraction: the material to show in its place.
    plain: dict[bpy.types.Material, bpy.types.Material] = {}
    lines = []
    for thing, index in found:
        material = thing.material_slots[index].material
        if not diffraction_nodes(material):
            continue  # another object of the selection, which shares material or mesh, came first
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
                lines.append(f"{material.name} stays as it is elsewhere; here it is {plain[material].name}")
            selection.put(thing, index, plain[material])
    return "; ".join(lines)


def slots_with_diffraction(thing: bpy.types.Object) -> list[int]:
    """The numbers of the object's slots whose material has diffraction."""
    return [index for index, slot in enumerate(thing.material_slots) if diffraction_nodes(slot.material)]
