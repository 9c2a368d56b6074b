# SPDX-License-Identifier: GPL-3.0-or-later
"""Removing diffraction from objects, without changing other objects."""

import bpy

from ..materials.material import diffraction_nodes, remove_diffraction
from .chosen_meshes import check_can_change
from .fitting_worlds import forget_unread_sources
from .material_slots import Selection, take_replaced, was_replaced


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
