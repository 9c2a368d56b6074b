# SPDX-License-Identifier: GPL-3.0-or-later
"""The lines that show the direction of an object's grating: for each material slot, with Rotation included."""

from dataclasses import dataclass

import bpy
import numpy as np

from ..direction.combed_mesh import singular_faces
from ..direction.direction_arrows import arrows, rings, seam_lines
from ..direction.surface_point import own_angle
from ..gratings.direction_source import STORED, DirectionSource
from ..materials.group_properties import frame_of
from ..materials.material import diffraction_nodes, linked_among, number_in

# More arrows are slower and no clearer.
_ARROWS_MAX = 5000


@dataclass(frozen=True)
class Lines:
    """Ends (n, 2, 3) of lines in world space: arrows along T, seams where T jumps, rings around a comb's singular
    faces."""

    arrows: np.ndarray
    seams: np.ndarray
    singular: np.ndarray


def direction_lines(thing: bpy.types.Object, depsgraph: bpy.types.Depsgraph, default: DirectionSource) -> Lines:
    """The lines of an evaluated mesh object. Slots without diffraction use `default`. A linked Rotation is ignored."""
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
    sources = dict.fromkeys(source for source, _ in frames)
    seams = [seam_lines(mesh, source) for source in sources]
    marks = [rings(mesh, singular_faces(mesh), among=len(chosen))] if any(s.kind == STORED for s in sources) else []
    world = np.array(evaluated.matrix_world)
    ends = (np.concatenate([*lines, np.empty((0, 2, 3))]) for lines in (parts, seams, marks))
    return Lines(*(each @ world[:3, :3].T + world[:3, 3] for each in ends))


def _frame(
    thing: bpy.types.Object, slot: bpy.types.MaterialSlot, default: DirectionSource
) -> tuple[DirectionSource, float]:
    """A slot's direction source, and the angle (radians) by which the material and the object turn it."""
    nodes = diffraction_nodes(slot.material)
    if not nodes:
        return default, own_angle(thing, default)
    node = nodes[0]
    source = frame_of(node.node_tree)
    return source, own_angle(thing, source) + (0.0 if linked_among(node, ["Rotation"]) else number_in(node, "Rotation"))
