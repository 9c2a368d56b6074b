# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake the active grating, in a process beside Blender."""

from typing import TYPE_CHECKING

import bpy
from bpy.props import StringProperty

from ...precompute.base.failure import GratingError
from ..scene.gratings import active_grating
from .follows_job import FollowsJob
from .report import report_failure, report_lines

if TYPE_CHECKING:
    from ..jobs.child import Job


class BakeGrating(FollowsJob, bpy.types.Operator):
    """Compute the active grating's diffraction table and measure its colour error. Esc cancels"""

    bl_idname = "grating.bake"
    bl_label = "Bake Grating"
    # Not REGISTER, whose panel Adjust Last Operation would bake again at each change, with Blender waiting.
    bl_options = {"UNDO"}

    directory: StringProperty(
        name="Folder", description="Where the bake is written; empty for the extension's own cache", subtype="DIR_PATH"
    )

    @classmethod
    def poll(cls, context):
        if BakeGrating.job is not None:
            cls.poll_message_set("A bake is running")
            return False
        if context.scene.natural_gratings.active() is None:
            cls.poll_message_set("Import a height map first")
            return False
        return True

    def execute(self, context):
        """Bake and wait, for scripts."""
        from ..actions.bake import bake_and_wait, warnings_of

        try:
            grating = active_grating(context.scene)
            facts = bake_and_wait(grating, self.directory)
        except GratingError as error:
            return report_failure(self, error)
        return report_lines(self, [f"{grating.name}: {grating.bake_summary}", *warnings_of(facts)])

    def invoke(self, context, event):
        """Start the bake; modal() then follows it."""
        from ..actions.bake import start_bake

        try:
            grating = active_grating(context.scene)
            job = start_bake(grating, self.directory)
        except GratingError as error:
            return report_failure(self, error)
        # Keep names, not the grating itself, which an undo during the bake may free.
        self._name, self._scene = grating.name, context.scene.name
        return self.follow(context, job, f"Baking {grating.name}")

    def finish(self, job: "Job"):
        """Record the bake."""
        from ..actions.bake import record_bake, warnings_of

        try:
            facts = job.result()
            scene = bpy.data.scenes.get(self._scene)
            grating = scene and scene.natural_gratings.items.get(self._name)
            if not grating:
                raise GratingError(f"{self._name}: no longer in the scene; its bake is {facts['files'][0]}")
            record_bake(grating, facts)
        except GratingError as error:
            return report_failure(self, error)
        return report_lines(self, [f"{grating.name}: {grating.bake_summary}", *warnings_of(facts)])
