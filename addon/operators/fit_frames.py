# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits light sources to each frame of an animated world."""

import bpy
from bpy.props import IntProperty

from ...precompute.base.failure import GratingError
from .follows_job import FollowsJob
from .reports import report_failure


class FitFrames(FollowsJob, bpy.types.Operator):
    """Find the bright parts of an animated world in each frame of the scene's frame range, and key them on the scene.
    They then light the diffraction without noise. Takes some seconds for each frame; Esc cancels"""

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
        try:
            job = self._job(context.scene)
            job.wait()
            self.report({"INFO"}, job.keep())
        except GratingError as error:
            return report_failure(self, error)
        return {"FINISHED"}

    def invoke(self, context, event):
        """Start the first fit; modal() then follows the job."""
        try:
            return self.follow(context, self._job(context.scene), "Fit Frames")
        except GratingError as error:
            return report_failure(self, error)

    def finish(self, job):
        try:
            self.report({"INFO"}, job.keep())
        except GratingError as error:
            return report_failure(self, error)
        return {"FINISHED"}

    def _job(self, scene):
        from ..workflow.fitting_frames import FrameFits

        first = scene.frame_start if self.first < 0 else self.first
        last = scene.frame_end if self.last < 0 else self.last
        return FrameFits(scene, list(range(first, last + 1, self.step or scene.frame_step)))
