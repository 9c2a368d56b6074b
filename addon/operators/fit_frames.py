# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits light sources to each frame of an animated world."""

import bpy
from bpy.props import IntProperty

from ...precompute.base.failure import GratingError
from .follows_job import FollowsJob
from .reports import report_failure


class FitFrames(FollowsJob, bpy.types.Operator):
    """Find the bright parts of an animated world in each frame of the scene's frame range, and key them on the scene.
    They then light the diffraction without noise. Takes some seconds for each frame"""

    bl_idname = "grating.fit_frames"
    bl_label = "Fit Frames"
    bl_options = {"REGISTER", "UNDO"}

    first: IntProperty(name="First", description="First frame. -1: the scene's", default=-1, min=-1)
    last: IntProperty(name="Last", description="Last frame. -1: the scene's", default=-1, min=-1)
    step: IntProperty(
        name="Step", description="Fit every so many frames; the frames between are noisy. 0: the scene's step",
        default=0, min=0,
    )  # fmt: skip

    @classmethod
    def poll(cls, context):
        if context.scene.world is None:
            cls.poll_message_set("Give the scene a world first")
            return False
        if cls.job is not None:
            cls.poll_message_set("Frames are being fitted already")
            return False
        return True

    def execute(self, context):
        """Fit and wait, for scripts."""
        from ..workflow.fitting_frames import fit_frames

        try:
            line = fit_frames(context.scene, first=self.first, last=self.last, step=self.step)
            self.report({"INFO"}, line)
        except GratingError as error:
            return report_failure(self, error)
        return {"FINISHED"}

    def invoke(self, context, event):
        """Start the first fit; modal() then follows the job."""
        from ..workflow.fitting_frames import FrameFits

        try:
            job = FrameFits.of_range(context.scene, first=self.first, last=self.last, step=self.step)
            return self.follow(context, job, "Fit Frames")
        except GratingError as error:
            return report_failure(self, error)

    def finish(self, job):
        try:
            self.report({"INFO"}, job.keep())
        except GratingError as error:
            return report_failure(self, error)
        return {"FINISHED"}
