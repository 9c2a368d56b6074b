# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the active grating in a separate process, whole or only the part that the scene needs, and chooses how exact
its bake is."""

import bpy
from bpy.props import BoolProperty, EnumProperty, StringProperty

from ...precompute.base.failure import printable
from ..gratings.grating import QUALITIES, active_grating, take_quality
from .shared import FollowsBake, has_grating, in_object_mode


class BakeGrating(FollowsBake, bpy.types.Operator):
    """Compute the colours of the active grating for all directions, and measure their error"""

    bl_idname = "grating.bake"
    bl_label = "Bake Grating"
    # Not REGISTER: its panel Adjust Last Operation would bake again at each change and block Blender.
    bl_options = {"UNDO"}

    directory: StringProperty(
        name="Folder", description="Folder for the bake. Empty: the extension's cache", subtype="DIR_PATH",
        options={"PATH_SUPPORTS_BLEND_RELATIVE"},
    )  # fmt: skip

    for_lamps: BoolProperty(
        name="For These Lamps",
        description="Bake so that lamps of different spectra light the grating with their own colours: the "
        "temperatures, LEDs, tubes and lines of the scene's lamps. It takes two to three times the memory",
        default=False, options={"SKIP_SAVE"},
    )  # fmt: skip

    @classmethod
    def description(cls, context, properties):
        return cls.__annotations__["for_lamps"].keywords["description"] if properties.for_lamps else cls.__doc__

    def start(self, context):
        from ..workflow.baking import light_of_scene, start_bake

        grating = active_grating(context.scene)
        if self.for_lamps:
            grating.illuminant = light_of_scene(context.scene)
        self._request = grating.bake_request()
        return self.follow_bake(context, grating, start_bake(grating, self.directory, request=self._request))

    def record(self, grating, facts):
        from ..workflow.baking import record_bake

        record_bake(grating, facts, self._request)
        return []


class BakeNeeds(FollowsBake, bpy.types.Operator):
    """Bake only the directions of the active grating that the scene's camera sees, over all frames if something moves.
    It stops early if that saves little memory. A single undo restores the former bake"""

    bl_idname = "grating.needs"
    bl_label = "Bake for This Scene"
    bl_options = {"UNDO"}  # as BakeGrating

    everything: BoolProperty(
        name="All Directions",
        description="Bake every direction again, not only those that the scene shows",
        default=False,
    )

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context) and super().poll(context)

    @classmethod
    def description(cls, context, properties):
        return cls.__annotations__["everything"].keywords["description"] if properties.everything else cls.__doc__

    def start(self, context):
        """Measure the needs, and start the bake unless there is nothing to gain."""
        from ...precompute.bake.needs import EVERYTHING
        from ..workflow.baking import measure_needs, request_with, start_bake

        grating = active_grating(context.scene)
        needs, self._lines = EVERYTHING, []
        if not self.everything:
            measured = measure_needs(context.scene, grating)
            found, *self._lines = measured.lines
            self.report({"INFO"}, printable(found))
            if measured.why_pointless:
                self.report({"WARNING"}, printable(measured.why_pointless))
                return None
            needs = measured.needs
        self._request = request_with(grating, needs)
        return self.follow_bake(context, grating, start_bake(grating, request=self._request))

    def record(self, grating, facts):
        from ..workflow.baking import no_smaller, record_bake
        from ..workflow.finding_bakes import notice_outside

        if not self.everything and (failure := no_smaller(grating, facts)):
            raise failure
        record_bake(grating, facts, self._request, taken_over=True)
        return [*self._lines, *notice_outside(bpy.context.scene)]


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
