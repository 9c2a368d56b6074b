# SPDX-License-Identifier: GPL-3.0-or-later
"""What of an object shows the direction of its grating: each slot by its own material, with Rotation."""

from dataclasses import dataclass

import bpy
import numpy as np

from ..frames.arrows import arrows, seam_lines
from ..frames.place import own_angle
from ..materials.material import diffraction_nodes
from ..materials.skin import frame_of
from ..scene.frame_source import FrameSource

# More arrows are no clearer, and slower.
_ARROWS_MAX = 5000


@dataclass(frozen=True)
class Lines:
    """Ends (n, 2, 3) of lines in the scene's space: arrows along T, and seams where it jumps."""

    arrows: np.ndarray
    seams: np.ndarray


def direction_lines(thing: bpy.types.Object, depsgraph: bpy.types.Depsgraph, default: FrameSource) -> Lines:
    """The lines of a mesh object, modifiers included. A slot without diffraction takes the direction from the default
    source. Rotation counts where it is a number, not a link."""
    evaluated = thing.evaluated_get(depsgraph)
    mesh = evaluated.data
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    chosen = np.unique(np.linspace(0, count - 1, min(count, _ARROWS_MAX)).astype(int)) if count else np.empty(0, int)
    polygons, slots = np.empty(count, np.int32), np.empty(len(mesh.polygons), np.int32)
    mesh.loop_triangles.foreach_get("polygon_index", polygons)
    mesh.polygons.foreach_get("material_index", slots)
    frames = [_frame(thing, slot, default) for slot in thing.material_slots] or [(default, own_angle(thing, default))]
    numbers = np.minimum(slots[polygons[chosen]], len(frames) - 1)
    parts = [
        arrows(mesh, chosen[numbers == number], source=source, angle=angle)
        for number, (source, angle) in enumerate(frames)
    ]
    seams = [seam_lines(mesh, source) for source in dict.fromkeys(source for source, _ in frames)]
    world = np.array(evaluated.matrix_world)
    return Lines(*(np.concatenate(lines) @ world[:3, :3].T + world[:3, 3] for lines in (parts, seams)))


def _frame(thing: bpy.types.Object, slot: bpy.types.MaterialSlot, default: FrameSource) -> tuple[FrameSource, float]:
    """A slot's source of the direction, and the angle by which the material and the object turn it."""
    nodes = diffraction_nodes(slot.material)
    if not nodes:
        return default, own_angle(thing, default)
    source, rotation = frame_of(nodes[0].node_tree), nodes[0].inputs["Rotation"]
    return source, own_angle(thing, source) + (0.0 if rotation.is_linked else rotation.default_value)
