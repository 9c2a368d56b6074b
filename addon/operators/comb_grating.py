# SPDX-License-Identifier: GPL-3.0-or-later
"""Combs the selected meshes in a separate process."""

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
    """Compute a smooth direction on the selected meshes and store it on them. With Direction set to Stored, the scan's
    x axis (left to right) follows it and not the UV map, also when the mesh deforms"""

    bl_idname = "grating.comb"
    bl_label = "Comb Grating"
    # Not REGISTER: its panel Adjust Last Operation would comb again at each change and block Blender.
    bl_options = {"UNDO"}

    source: EnumProperty(name="Source", description="What the direction follows", items=COMB_SOURCES)

    @classmethod
    def poll(cls, context):
        if CombGrating.job is not None:
            cls.poll_message_set("Wait until the running comb ends, or cancel it")
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
        """Store the comb."""
        from ..workflow.combing import finish_comb

        try:
            return self._reported(finish_comb(job))
        except GratingError as error:
            return report_failure(self, error)

    def _reported(self, lines: list[str]) -> set[str]:
        """Report every line as information."""
        for line in lines:
            report_lines(self, [line])
        return {"FINISHED"}
