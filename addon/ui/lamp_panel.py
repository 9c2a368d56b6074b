# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel of a lamp's own spectrum, among the settings of the lamp."""

import bpy

from ...precompute.base.failure import GratingError
from ..blender.guard import guarded_draw
from ..gratings.wording import in_words
from ..lamps.lamp_spectrum import FIELD, canonical_spectrum, spectrum_of
from .light_part import draw_spectrum
from .notes import draw_note


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
        if getattr(light, FIELD) and not spectrum_of(light):
            draw_note(self.layout, context, _fault(getattr(light, FIELD)), icon="ERROR")


def _fault(text: str) -> str:
    try:
        canonical_spectrum(text)
    except GratingError as error:
        return in_words(error)
    return ""
