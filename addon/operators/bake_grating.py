# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the active grating in a separate process."""

import bpy
from bpy.props import BoolProperty, StringProperty

from ...precompute.base.failure import GratingError
from ..gratings.grating import active_grating
from .follows_bake import FollowsBake
from .reports import report_failure


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

    def execute(self, context):
        """Bake and wait, for scripts."""
        from ..workflow.baking import finished_bake

        try:
            grating = self._grating(context)
            return self.report_bake(grating, finished_bake(grating, self.directory, request=self._request))
        except GratingError as error:
            return report_failure(self, error)

    def invoke(self, context, event):
        """Start the bake; modal() then follows it."""
        from ..workflow.baking import start_bake

        try:
            grating = self._grating(context)
            job = start_bake(grating, self.directory, request=self._request)
            return self.follow_bake(context, grating, job)
        except GratingError as error:
            return report_failure(self, error)

    def _grating(self, context):
        """The active grating, with its request prepared."""
        from ..workflow.baking_for_lamps import light_of_scene

        grating = active_grating(context.scene)
        if self.for_lamps:
            grating.illuminant = light_of_scene(context.scene)
        self._request = grating.bake_request()
        return grating

    def record(self, grating, facts):
        from ..workflow.baking import record_bake

        record_bake(grating, facts, self._request)
        return []
