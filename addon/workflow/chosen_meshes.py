# SPDX-License-Identifier: GPL-3.0-or-later
"""Checking which selected objects can carry a grating, and why the others cannot."""

import bpy
import numpy as np

from ...precompute.base.failure import GratingError
from ..direction.tangent_frame import check_frame_map
from ..direction.uv_maps import has_uv_map
from ..gratings.direction_source import DIRECTION_REMEDY, FRAME_MAP, STORED, DirectionSource

# Object types that Blender can convert to meshes, with their names in messages.
_CONVERTIBLE = {
    "CURVE": "curve",
    "SURFACE": "surface",
    "META": "metaball",
    "FONT": "text",
    "CURVES": "hair",
    "POINTCLOUD": "point cloud",
}


def meshes_among(
    scene: bpy.types.Scene, objects: list[bpy.types.Object], source: DirectionSource
) -> list[bpy.types.Object]:
    """The meshes among the objects. Raises GratingError if there is none, or if one does not suit the direction
    source."""
    meshes = [o for o in objects if o.type == "MESH"]
    if not meshes:
        raise no_mesh(scene, objects)
    for mesh in meshes:
        check_can_change(mesh)
        check_frame(mesh, source)
    return meshes


def no_meshes(objects: list[bpy.types.Object]) -> list[str]:
    """A line with the remedy for each object that has a surface but is no mesh."""
    return [str(each) for each in _passed_over(objects)]


def no_mesh(scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> GratingError:
    """The error for objects without a mesh among them."""
    passed_over = _passed_over(objects)
    return passed_over[0] if passed_over else GratingError(f"scene {scene.name}", "no mesh is selected", "select one")


def _passed_over(objects: list[bpy.types.Object]) -> list[GratingError]:
    remedy = "use Object > Convert > Mesh, then unwrap it"
    return [
        GratingError(o.name, f"a {_CONVERTIBLE[o.type]} cannot show a grating", remedy)
        for o in objects
        if o.type in _CONVERTIBLE
    ]


def check_can_change(thing: bpy.types.Object) -> None:
    """Raise GratingError unless the object's materials can be changed: it is not linked, or has a library override."""
    override = thing.override_library
    if thing.library is not None or (override is not None and override.is_system_override):
        file = (thing.library or override.reference.library).filepath
        raise GratingError(
            thing.name,
            f"linked from {file}",
            "use Object > Library Override > Make, or Object > Relations > Make Local",
        )
    if data_is_fixed(thing) and not thing.material_slots:
        raise GratingError(
            thing.name,
            f"its mesh {thing.data.name} is linked from another file and has no material slot",
            "use Object > Relations > Make Local > Selected Objects and Data",
        )


def check_not_edited(mesh: bpy.types.Object) -> None:
    """Raise GratingError for a mesh in Edit Mode, whose faces and UV maps cannot be read."""
    if mesh.data.is_editmode:
        raise GratingError(mesh.name, "in Edit Mode", "switch to Object Mode first")


def check_frame(mesh: bpy.types.Object, source: DirectionSource) -> None:
    """Raise GratingError unless the mesh has faces, and what the direction source needs."""
    check_not_edited(mesh)
    if not mesh.data.polygons and (mesh.data.uv_layers or source.kind != STORED):
        raise GratingError(mesh.name, "no faces to put a material on", "choose a mesh with faces")
    if not has_uv_map(mesh.data, source):
        if source.named_uv_map:
            raise GratingError(
                mesh.name,
                f"no UV map {source.named_uv_map}, from which the grating takes its direction",
                "make one, or choose another Direction Source",
            )
        raise GratingError(mesh.name, "no UV map, so no direction for the grating", DIRECTION_REMEDY)
    if source.kind == FRAME_MAP and source.frame_map is not None:
        check_frame_map(mesh, source.frame_map)


def data_is_fixed(thing: bpy.types.Object) -> bool:
    """Whether the object's data belongs to another file, so that only the object's own slots can change."""
    return thing.data.library is not None or thing.data.override_library is not None


def slots_with_faces(mesh: bpy.types.Object) -> list[bpy.types.MaterialSlot]:
    """The mesh's material slots that faces use. As in Blender, a slot index that is too high means the last slot."""
    slots = mesh.material_slots
    if not slots:
        return []
    numbers = np.empty(len(mesh.data.polygons), np.int32)
    mesh.data.polygons.foreach_get("material_index", numbers)
    return [slots[number] for number in np.unique(np.minimum(numbers, len(slots) - 1))]
