# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds a Diffraction Lamp to the active object."""

import bpy
from bpy.props import FloatProperty, StringProperty

from ...precompute.base.failure import GratingError
from ..blender.guard import guarded, guarded_draw
from .polls import in_object_mode
from .reports import report_failure, report_lines


class AddDiffractionLamp(bpy.types.Operator):
    """Add a lamp that throws the spectrum of the active object's grating onto walls and screens, without noise. It
    stands for a square patch of the surface, at the point nearest to the 3D cursor. Cycles only"""

    bl_idname = "grating.add_diffraction_lamp"
    bl_label = "Diffraction Lamp"
    bl_options = {"REGISTER", "UNDO"}

    size_mm: FloatProperty(
        name="Patch Size (mm)",
        description="Side of the square patch, in millimetres. A larger patch sends more light and blurs the spectrum",
        default=10.0,
        min=1e-3,
        soft_min=0.1,
        soft_max=100.0,
    )
    lamp: StringProperty(
        name="Lit by", description="Lamp whose light the patch diffracts. Empty: the first lamp in the panel"
    )

    @classmethod
    def poll(cls, context):
        from ..workflow.adding_diffraction_lamps import shows_grating

        if not in_object_mode(cls, context):
            return False
        if not shows_grating(context.active_object):
            cls.poll_message_set("Select a mesh that shows a grating first")
            return False
        return True

    @guarded_draw
    def draw(self, context):
        self.layout.prop(self, "size_mm")
        self.layout.prop_search(self, "lamp", context.scene, "objects", icon="LIGHT")

    def execute(self, context):
        from ..workflow.adding_diffraction_lamps import add_diffraction_lamp

        try:
            diffraction_lamp, lines = add_diffraction_lamp(
                context.scene, context.active_object, context.evaluated_depsgraph_get(),
                near=context.scene.cursor.location, size_m=self.size_mm * 1e-3, lamp_name=self.lamp,
            )  # fmt: skip
        except GratingError as error:
            return report_failure(self, error)
        return report_lines(self, lines)


@guarded
def menu_entry(menu: bpy.types.Menu, _: bpy.types.Context) -> None:
    """Draw the entry in Add > Light."""
    menu.layout.operator(AddDiffractionLamp.bl_idname, icon="LIGHT_AREA")
