# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of a lamp's own spectrum, among the settings of the lamp."""

import bpy

from ..blender.guard import guarded_draw
from .light_part import draw_fault, draw_spectrum


class LampSpectrumPanel(bpy.types.Panel):
    """A lamp's spectrum, which gratings split into colours"""

    bl_idname = "GRATING_PT_lamp_spectrum"
    bl_label = "Diffraction Spectrum"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "data"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return getattr(context, "light", None) is not None

    @guarded_draw
    def draw(self, context):
        light = getattr(context, "light", None)
        if light is None:  # Blender draws once more after the last lamp was deleted
            return
        draw_spectrum(self.layout, light)
        draw_fault(self.layout, context, light)
