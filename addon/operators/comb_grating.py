# SPDX-License-Identifier: GPL-3.0-or-later
"""Comb the selected meshes, in a process beside Blender."""

from typing import TYPE_CHECKING

import bpy
from bpy.props import EnumProperty

from ...precompute.base.failure import GratingError
from ..gratings.direction_source import COMB_SOURCES
from .follows_job import FollowsJob
from .polls import has_selected_mesh, in_object_mode
from .reports import report_failure, report_lines

if TYPE_CHECKING:
    from ..workflow.combing import CombJob


class CombGrating(FollowsJob, bpy.types.Operator):
    """Lay a smooth direction over the selected meshes and store it on them. The scan's x axis (left to right) follows
    it if the grating's Direction is Stored, whatever the UV map. It moves with the deformed mesh. Esc cancels"""

    bl_idname = "grating.comb"
    bl_label = "Comb Grating"
    # Not REGISTER, whose panel Adjust Last Operation would comb again at each change, with Blender waiting.
    bl_options = {"UNDO"}

    source: EnumProperty(name="Source", description="What the direction follows", items=COMB_SOURCES)

    @classmethod
    def poll(cls, context):
        if CombGrating.job is not None:
            cls.poll_message_set("A comb is running")
            return False
        return in_object_mode(cls, context) and has_selected_mesh(cls, context)

    def execute(self, context):
        """Comb and wait, for scripts."""
        from ..workflow.combing import comb_and_wait

        try:
            return self._reported(comb_and_wait(context.scene, context.selected_objects, self.source))
        except GratingError as error:
            return report_failure(self, error)

    def invoke(self, context, event):
        """Start the comb; modal() then follows it."""
        from ..workflow.combing import start_comb

        try:
            job = start_comb(context.scene, context.selected_objects, self.source)
        except GratingError as error:
            return report_failure(self, error)
        return self.follow(context, job, f"Combing {', '.join(name for name, _ in job.meshes)}")

    def finish(self, job: "CombJob"):
        """Store what was combed."""
        from ..workflow.combing import finish_comb

        try:
            return self._reported(finish_comb(job))
        except GratingError as error:
            return report_failure(self, error)

    def _reported(self, lines: list[str]) -> set[str]:
        """Every line is one on what was done."""
        for line in lines:
            report_lines(self, [line])
        return {"FINISHED"}
