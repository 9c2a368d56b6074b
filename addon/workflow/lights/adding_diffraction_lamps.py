# SPDX-License-Identifier: GPL-3.0-or-later
"""Adding a Diffraction Lamp (materials/diffraction_lamp.py) to an object that shows a grating."""

import bpy
from mathutils import Vector

from ....precompute.base.failure import GratingError
from ...direction.tangents import Place, own_angle, place_nearest
from ...gratings.grating import LAMPS_ONLY
from ...lamps.brightest_lamps import lamps_of
from ...lamps.follow import counted_lamps
from ...materials.diffraction_lamp import new_diffraction_lamp
from ...materials.group_properties import frame_of, lights_of
from ...materials.lost_parts import faults_of
from ...materials.material import diffraction_nodes, number_in
from ...materials.response import SETTINGS, response_in

# Height of the lamp above its patch, in patch sizes, so that small bumps of the surface do not shade it.
_HEIGHT = 0.05


def add_diffraction_lamp(
    scene: bpy.types.Scene, mesh: bpy.types.Object, depsgraph: bpy.types.Depsgraph, *,
    near: Vector, size_m: float, lamp_name: str = "",
) -> tuple[bpy.types.Object, list[str]]:  # fmt: skip
    """Add a Diffraction Lamp where a mesh is nearest to the point `near` in world space. Returns the new lamp and lines
    to report: what was done, then warnings.

    The patch is a square with side `size_m`. `lamp_name` is the lamp that lights it; by default the first in the
    panel's list. Raises GratingError, with nothing added, if there is no such lamp, or no grating at that place."""
    lamp = _lamp_named(scene, lamp_name)
    place = place_nearest(
        mesh, depsgraph, to=near, source_at=lambda slot: frame_of(_diffraction_in(mesh, slot).node_tree)
    )
    node = _diffraction_in(mesh, place.slot)
    if missing := faults_of([node.node_tree]):
        raise missing[0]
    response = response_in(node.node_tree)
    assert response is not None  # `faults_of` names a group without one
    values = {name: number_in(node, name) for name in ("Strength", "Base Blend", "Rotation")}
    diffraction_lamp = new_diffraction_lamp(
        scene, response, lamp, size_m=size_m,
        strength=values["Strength"] * (1.0 - values["Base Blend"]),
        settings={socket: number_in(node, socket.name) for socket in SETTINGS},
    )  # fmt: skip
    scene.collection.objects.link(diffraction_lamp)
    diffraction_lamp.parent, diffraction_lamp.matrix_parent_inverse = mesh, mesh.matrix_world.inverted_safe()
    rotation = values["Rotation"] + own_angle(mesh, frame_of(node.node_tree))
    diffraction_lamp.matrix_basis = place.lamp_matrix(rotation=rotation, height=_HEIGHT * size_m)
    done = f"{diffraction_lamp.name}: on {mesh.name}, throws the colours of {lamp.name}; only Cycles shows them"
    return diffraction_lamp, [done, *_warnings(scene, node, place, lamp)]


def shows_grating(thing: bpy.types.Object | None) -> bool:
    """Whether the object is a mesh with a diffraction material."""
    if thing is None or thing.type != "MESH":
        return False
    return any(diffraction_nodes(slot.material) for slot in thing.material_slots)


def _lamp_named(scene: bpy.types.Scene, name: str) -> bpy.types.Object:
    lamps = lamps_of(scene)
    if not lamps:
        raise GratingError(f"scene {scene.name}", "no lamp lights the grating", "add a sun")
    if not name:
        return (counted_lamps(scene) or lamps)[0]
    found = next((lamp for lamp in lamps if lamp.name == name), None)
    if found is None:
        raise GratingError(name, "no lamp of the scene", f"there are {', '.join(sorted(lamp.name for lamp in lamps))}")
    return found


def _diffraction_in(mesh: bpy.types.Object, slot: int) -> bpy.types.Node:
    """The Diffraction node in a mesh's slot. As in Blender, a slot index that is too high means the last slot."""
    slots = mesh.material_slots
    nodes = diffraction_nodes(slots[min(slot, len(slots) - 1)].material) if slots else []
    if not nodes:
        raise GratingError(mesh.name, "no grating at that place", "assign one, or choose another place")
    return nodes[0]


def _warnings(scene: bpy.types.Scene, node: bpy.types.Node, place: Place, lamp: bpy.types.Object) -> list[str]:
    lines = []
    linked = [socket.name for socket in node.inputs if socket.is_linked and socket.name != "Base"]
    if linked:
        lines.append(f"{node.name}: it ignores the links to its {', '.join(linked)}; set the lamp's own nodes")
    matrix = lamp.matrix_world
    to_lamp = matrix.col[2].xyz if lamp.data.type == "SUN" else matrix.translation - place.position
    if to_lamp.dot(place.normal) <= 0:
        lines.append(
            f"{lamp.name}: it is behind the patch, so the patch is dark; move the lamp, or choose another place"
        )
    if lights_of(node.node_tree) != LAMPS_ONLY and scene.cycles.caustics_reflective:
        lines.append("the material also throws mirror images, as dots; switch Caustics > Reflective off")
    if scene.render.engine != "CYCLES":
        lines.append("only Cycles shows a Diffraction Lamp; in other renderers it is dark")
    return lines
