# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits light sources to the bright parts of the scene's world."""

import bpy

from ...precompute.base.failure import GratingError
from .reports import report_failure


class FitWorld(bpy.types.Operator):
    """Find the sun, windows and other bright parts of the world. They then light the diffraction without noise"""

    bl_idname = "grating.fit_world"
    bl_label = "Fit World"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        if context.scene.world is None:
            cls.poll_message_set("Give the scene a world first")
            return False
        return True

    def execute(self, context):
        """Fit and wait, for scripts."""
        from ..workflow.fitting_worlds import fit_world

        try:
            fit_world(context.scene, anew=True)
        except GratingError as error:
            return report_failure(self, error)
        return {"FINISHED"}

    def invoke(self, context, event):
        """Schedule a fit in the background."""
        from ..workflow.fitting_worlds import want_fit

        try:
            want_fit(context.scene, anew=True)
        except GratingError as error:
            return report_failure(self, error)
        return {"FINISHED"}
