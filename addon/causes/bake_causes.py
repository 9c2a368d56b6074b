# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks whether there is a grating, whether it is baked, and whether its material is whole and on an object."""

from collections.abc import Iterator

import bpy
import numpy as np

from ...precompute.base.failure import GratingError
from ..gratings.grating import Grating
from ..materials.group_properties import is_diffraction
from ..materials.group_users import listed
from ..materials.lost_parts import lost_of_nodes, lost_of_others, lost_of_own
from ..materials.material import diffraction_nodes, empty_nodes, shows_diffraction
from ..materials.skin import crowded
from .cause import Button, Cause, mend
from .subject import Subject

_BAKE = Button("grating.bake", "Bake Grating", invoked=True)


def before_assigning(scene: bpy.types.Scene) -> Cause:
    """Why no mesh of the scene shows its active grating."""
    grating = scene.natural_gratings.active()
    if grating is None:
        return Cause("NO_GRATING", "The list has no grating. Import a height map, or add a sample or a preset.")
    if (emptied := _emptied(grating)) is not None:
        return emptied
    if not is_diffraction(grating.group) and (cause := _unbaked(grating)) is not None:
        return cause
    assign = Button("grating.assign", "Assign to Selected")
    return Cause("NOT_ASSIGNED", f"No object shows {grating.name}. Select a mesh and assign the grating to it.", assign)


def _emptied(grating: Grating) -> Cause | None:
    """The cause that the node group of the grating's material was deleted."""
    if grating.material is None or not empty_nodes(grating.material):
        return None
    mended = Button("grating.mend", "Mend Materials")
    return Cause("LOST", f"The node group in {grating.material.name} was deleted.", mended)


def _unbaked(grating: Grating) -> Cause | None:
    """The cause that a grating has no bake to make a material from."""
    bake = _BAKE if grating.source else None
    if not grating.bake_path:
        return Cause("NOT_BAKED", f"{grating.name} is not baked yet.", bake)
    try:
        grating.baked_file()
    except GratingError:
        return Cause("BAKE_GONE", f"The file of the bake of {grating.name} is gone.", bake)
    return None


def lost_parts(subject: Subject) -> Iterator[Cause]:
    """Deleted or edited pictures, nodes and node groups."""
    group = subject.group
    own = lost_of_own(group)
    fault = own or lost_of_nodes(group) or lost_of_others(group)
    if fault:
        bakes_again = own and _unbaked(subject.grating) is not None and subject.grating.source
        mended = _BAKE if bakes_again else Button("grating.mend", "Mend Materials")
        yield Cause("LOST", f"The material of {subject.grating.name} is damaged: {fault}.", mended)
    elif subject.scene.render.engine != "CYCLES":
        yield from (Cause("CROWDED", f"{line[0].upper()}{line[1:]}.") for line in crowded(group))


def unlinked(subject: Subject) -> Iterator[Cause]:
    """Materials whose output does not show their Diffraction node, and meshes without a face in its slot."""
    in_cycles = subject.scene.render.engine == "CYCLES"
    loose = [each for each in subject.materials if not shows_diffraction(each, in_cycles=in_cycles)]
    if loose:
        text = f"The Diffraction node of {listed(loose)} is not connected to the Material Output, or is muted."
        yield Cause("UNLINKED", text, mend("CONNECT", "Connect the Diffraction"))
    bare = [thing for thing in subject.things if not _has_faces(thing, subject.group)]
    if len(bare) == len(subject.things):
        yield Cause(
            "NO_FACES", f"No face of {listed(bare)} uses the material slot with {subject.grating.name}.",
            mend("GIVE_FACES", "Give the Slot All Faces"),
        )  # fmt: skip


def _has_faces(thing: bpy.types.Object, group: bpy.types.NodeTree) -> bool:
    """Whether a face of a mesh uses a slot whose material has a group. True in Edit Mode, where faces are unknown."""
    slots = thing.material_slots
    held = {i for i, slot in enumerate(slots) if any(n.node_tree == group for n in diffraction_nodes(slot.material))}
    if thing.data.is_editmode or len(held) == len(slots) or not thing.data.polygons:
        return True
    return bool(held & _used_slots(thing))


def _used_slots(thing: bpy.types.Object) -> set[int]:
    """The material slots that faces of a mesh use. As in Blender, an index that is too high means the last slot."""
    numbers = np.empty(len(thing.data.polygons), np.int32)
    thing.data.polygons.foreach_get("material_index", numbers)
    return set(np.minimum(np.unique(numbers), len(thing.material_slots) - 1).tolist())
