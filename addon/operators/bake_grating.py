# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the active grating in a separate process."""

import bpy
from bpy.props import StringProperty

from ...precompute.base.failure import GratingError
from ..gratings.grating import active_grating
from .follows_bake import FollowsBake
from .reports import report_failure


class BakeGrating(FollowsBake, bpy.types.Operator):
    """Compute the colours of the active grating for all directions, and measure their error. Esc cancels"""

    bl_idname = "grating.bake"
    bl_label = "Bake Grating"
    # Not REGISTER: its panel Adjust Last Operation would bake again at each change and block Blender.
    bl_options = {"UNDO"}

    directory: StringProperty(
        name="Folder", description="Folder for the bake. Empty: the extension's cache", subtype="DIR_PATH"
    )

    def execute(self, context):
        """Bake and wait, for scripts."""
        from ..workflow.baking import finished_bake

        try:
            grating = active_grating(context.scene)
            self._request = grating.bake_request()
            return self.report_bake(grating, finished_bake(grating, self.directory, request=self._request))
        except GratingError as error:
            return report_failure(self, error)

    def invoke(self, context, event):
        """Start the bake; modal() then follows it."""
        from ..workflow.baking import start_bake

        try:
            grating = active_grating(context.scene)
            self._request = grating.bake_request()
            job = start_bake(grating, self.directory, request=self._request)
            return self.follow_bake(context, grating, job)
        except GratingError as error:
            return report_failure(self, error)

    def record(self, grating, facts):
        from ..workflow.baking import record_bake

        record_bake(grating, facts, self._request)
        return []
