# SPDX-License-Identifier: GPL-3.0-or-later
"""Lay the active grating's diffraction over the materials that the selected meshes have."""

import bpy

from ...precompute.failure import GratingError
from ..gratings import active_grating
from ..materials.diffraction import add_diffraction
from .assign import OnSelectedMeshes, meshes_among
from .new_material import group_of


class AddDiffraction(OnSelectedMeshes, bpy.types.Operator):
    """Lay the active grating's diffraction over the selected meshes' own materials, or swap what they have of it"""

    bl_idname = "grating.add_diffraction"
    bl_label = "Add to Materials"
    bl_options = {"REGISTER", "UNDO"}

    def put(self, scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> str:
        return add_to_meshes(scene, objects)


def add_to_meshes(scene: bpy.types.Scene, objects: list[bpy.types.Object]) -> str:
    """Lay diffraction over the active materials of the meshes among the objects; one line of what was done.

    Raises GratingError, with nothing changed, if a mesh has no material or no direction for the grating, or the bake
    or all lamps are missing."""
    meshes = meshes_among(scene, objects)
    for mesh in meshes:
        if mesh.active_material is None:
            raise GratingError(f"{mesh.name}: no material to add diffraction to; use Assign to Selected")
    materials = list(dict.fromkeys(mesh.active_material for mesh in meshes))
    grating = active_grating(scene)
    group = group_of(scene, grating)
    for material in materials:
        add_diffraction(material, group)
    return f"{grating.name}: over {', '.join(material.name for material in materials)}"
