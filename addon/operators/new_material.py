# SPDX-License-Identifier: GPL-3.0-or-later
"""Make a diffraction material from the active grating's bake."""

import bpy

from ...precompute.failure import GratingError
from .. import key_lights
from ..gratings import Grating, active_grating
from ..materials.diffraction import new_diffraction_group, new_diffraction_material, show_key_lights


class NewDiffractionMaterial(bpy.types.Operator):
    """Make a diffraction material from the active grating's bake, lit by the scene's lamps"""

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
    """A new material of a baked grating. Raises GratingError if the bake or all lamps are missing."""
    grating.material = new_diffraction_material(grating.name, group_of(scene, grating))
    return grating.material


def group_of(scene: bpy.types.Scene, grating: Grating) -> bpy.types.NodeTree:
    """The node group of a baked grating, made if need be, the scene's lamps followed.

    Raises GratingError, with nothing changed, if the bake or all lamps are missing."""
    key_lights.find_lamps(scene)
    bake = grating.baked_file()
    key_lights.follow_lamps(scene)
    if grating.group is None:
        grating.group = new_diffraction_group(bake, grating.shadows)
    show_key_lights()
    # EEVEE's usual ten bits to a normal put colours off by 1.5 % (median, a sphere) to 10 %.
    scene.render.use_high_quality_normals = True
    return grating.group
