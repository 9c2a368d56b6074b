# SPDX-License-Identifier: GPL-3.0-or-later
"""Assign the active grating's material to the selected meshes."""

import bpy

from ...precompute.failure import GratingError
from ..gratings import active_grating
from .new_material import group_of, make_material


class OnSelectedMeshes:
    """What an operator that puts a grating on the selected meshes does beside `put`, which says what was done or
    raises GratingError."""

    @classmethod
    def poll(cls, context):
        return poll_meshes(cls, context)

    def execute(self, context):
        try:
            report = self.put(context.scene, context.selected_objects)
        except GratingError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, report)
        return {"FINISHED"}


class AssignToSelected(OnSelectedMeshes, bpy.types.Operator):
    """Put the active grating's material (made if need be) on the selected meshes; the grating's columns run along U"""

    bl_idname = "grating.assign"
    bl_label = "Assign to Selected"
    bl_options = {"REGISTER", "UNDO"}

    def put(self, scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> str:
        return assign_to_meshes(scene, objects)


def poll_meshes(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether there is a baked grating and a mesh to put it on; the button says what is missing."""
    grating = context.scene.natural_gratings.active()
    if grating is None or not grating.bake_path:
        operator.poll_message_set("Bake a grating first")
        return False
    if not any(o.type == "MESH" for o in context.selected_objects):
        operator.poll_message_set("Select a mesh first")
        return False
    return True


def assign_to_meshes(scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> str:
    """Put the active grating's material on the meshes among the objects; one line of what was done.

    Raises GratingError, with nothing assigned, if a mesh has no direction for the grating, or the bake or all lamps
    are missing."""
    meshes = meshes_among(scene, objects)
    grating = active_grating(scene)
    group_of(scene, grating)
    material = grating.material or make_material(scene, grating)
    for mesh in meshes:
        put_material(mesh, material)
    return f"{material.name}: on {', '.join(o.name for o in meshes)}"


def meshes_among(scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> list[bpy.types.Object]:
    """The meshes, each with a direction for the grating. Raises GratingError if one has none, or there is none."""
    meshes = [o for o in objects if o.type == "MESH"]
    if not meshes:
        raise GratingError(f"scene {scene.name}: no mesh is selected; select one or name it")
    for mesh in meshes:
        check_frame(mesh)
    return meshes


def check_frame(mesh: bpy.types.Object) -> None:
    """Raises GratingError unless the mesh has a UV map, whose U is the grating's direction."""
    if not mesh.data.uv_layers:
        raise GratingError(f"{mesh.name}: no UV map, so no direction for the grating; unwrap it, U along the body")
    if not mesh.data.polygons:
        raise GratingError(f"{mesh.name}: no faces to put a material on; choose a mesh with faces")


def put_material(mesh: bpy.types.Object, material: bpy.types.Material) -> None:
    """The object's active slot, made if it has none."""
    if mesh.material_slots:
        mesh.material_slots[mesh.active_material_index].material = material
    else:
        mesh.data.materials.append(material)
