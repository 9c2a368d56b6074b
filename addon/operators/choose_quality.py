# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses how exact the active grating's bake is."""

import bpy
from bpy.props import EnumProperty

from ..gratings.bake_quality import QUALITIES, take_quality
from ..gratings.grating import active_grating
from .polls import has_grating


class ChooseQuality(bpy.types.Operator):
    """Choose how exact the next bake is"""

    bl_idname = "grating.choose_quality"
    bl_label = "Quality"
    bl_options = {"REGISTER", "UNDO"}

    quality: EnumProperty(
        name="Quality", description="How exact the bake is", items=[(q.name, q.label, q.tooltip) for q in QUALITIES]
    )

    @classmethod
    def description(cls, context, properties):
        return next(q.tooltip for q in QUALITIES if q.name == properties.quality)

    @classmethod
    def poll(cls, context):
        return has_grating(cls, context)

    def execute(self, context):
        take_quality(active_grating(context.scene), self.quality)
        return {"FINISHED"}
