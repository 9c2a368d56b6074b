# SPDX-License-Identifier: GPL-3.0-or-later
"""Make a diffraction material from the active grating's bake."""

import bpy

from ...precompute.failure import GratingError
from .. import key_light
from ..gratings import Grating, active_grating
from ..materials.diffraction import new_diffraction_material


class NewDiffractionMaterial(bpy.types.Operator):
    """Make a diffraction material from the active grating's bake, lit by the scene's sun"""

    bl_idname = "grating.new_material"
    bl_label = "New Diffraction Material"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        grating = context.scene.natural_gratings.active()
        if grating is None or not grating.bake_path:
            cls.poll_message_set("Bake a grating first")
            return False
        return True

    def execute(self, context):
        try:
            material = make_material(context.scene, active_grating(context.scene))
        except GratingError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{material.name}: assign it to a mesh that has a UV map")
        return {"FINISHED"}


def make_material(scene: bpy.types.Scene, grating: Grating) -> bpy.types.Material:
    """A new material of a baked grating, its key light following the scene's sun.

    Raises GratingError if the bake or the sun is missing."""
    bake = grating.baked_file()
    key_light.follow_sun(scene, key_light.find_sun(scene))
    grating.material = new_diffraction_material(bake)
    return grating.material
