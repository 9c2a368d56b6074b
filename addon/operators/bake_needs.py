# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes only the part of the active grating that the scene needs, in a separate process."""

import bpy
from bpy.props import BoolProperty

from ...precompute.base.failure import GratingError, printable
from ..gratings.grating import active_grating
from .follows_bake import FollowsBake
from .polls import in_object_mode
from .reports import report_failure


class BakeNeeds(FollowsBake, bpy.types.Operator):
    """Bake only the directions of the active grating that the scene's camera sees, over all frames if something moves.
    It stops early if that saves little memory. A single undo restores the former bake"""

    bl_idname = "grating.needs"
    bl_label = "Bake for This Scene"
    # Not REGISTER: its panel Adjust Last Operation would bake again at each change and block Blender.
    bl_options = {"UNDO"}

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

    def execute(self, context):
        """Measure, bake and wait, for scripts."""
        from ..workflow.baking import finished_bake

        try:
            if (grating := self._measure(context)) is None:
                return {"CANCELLED"}
            return self.report_bake(grating, finished_bake(grating, request=self._request))
        except GratingError as error:
            return report_failure(self, error)

    def invoke(self, context, event):
        """Measure, and start the bake; modal() then follows it."""
        from ..workflow.baking import start_bake

        try:
            if (grating := self._measure(context)) is None:
                return {"CANCELLED"}
            return self.follow_bake(context, grating, start_bake(grating, request=self._request))
        except GratingError as error:
            return report_failure(self, error)

    def record(self, grating, facts):
        from ..workflow.baking import record_bake
        from ..workflow.measuring_needs import no_smaller
        from ..workflow.noticing_outside import notice_outside

        if not self.everything and (failure := no_smaller(grating, facts)):
            raise failure
        record_bake(grating, facts, self._request, taken_over=True)
        return [*self._lines, *notice_outside(bpy.context.scene)]

    def _measure(self, context):
        """Measure the needs and prepare the request. Returns the grating, or None if there is nothing to gain."""
        from ...precompute.bake.needs import EVERYTHING
        from ..workflow.measuring_needs import measure_needs, request_with

        grating = active_grating(context.scene)
        needs, self._lines = EVERYTHING, []
        if not self.everything:
            measured = measure_needs(context.scene, grating)
            found, *self._lines = measured.lines
            self.report({"INFO"}, printable(found))
            if measured.pointless:
                self.report({"WARNING"}, printable(measured.pointless))
                return None
            needs = measured.needs
        self._request = request_with(grating, needs)
        return grating
