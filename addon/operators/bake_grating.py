# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake the active grating, in a process beside Blender."""

from typing import TYPE_CHECKING

import bpy
from bpy.props import StringProperty

from ...precompute.base.failure import GratingError
from ..scene.gratings import active_grating
from .report import report_failure, report_lines

if TYPE_CHECKING:
    from ..jobs.child import Job

_POLL_SECONDS = 0.2


class BakeGrating(bpy.types.Operator):
    """Compute the active grating's diffraction table and measure its colour error. Esc cancels"""

    bl_idname = "grating.bake"
    bl_label = "Bake Grating"
    # Not REGISTER, whose panel Adjust Last Operation would bake again at each change, with Blender waiting.
    bl_options = {"UNDO"}

    directory: StringProperty(
        name="Folder", description="Where the bake is written; empty for the extension's own cache", subtype="DIR_PATH"
    )

    # The bake that runs beside the interface, if any. The panel shows it; disabling the extension stops it.
    job = None

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
        from ..actions.bake import bake_and_wait

        try:
            grating = active_grating(context.scene)
            bake_and_wait(grating, self.directory)
        except GratingError as error:
            return report_failure(self, error)
        return report_lines(self, [f"{grating.name}: {grating.bake_summary}"])

    def invoke(self, context, event):
        """Start the bake; modal() then follows it."""
        from ..actions.bake import start_bake

        try:
            grating = active_grating(context.scene)
            BakeGrating.job = start_bake(grating, self.directory)
        except GratingError as error:
            return report_failure(self, error)
        # Keep names, not the grating itself, which an undo during the bake may free.
        self._name, self._scene = grating.name, context.scene.name
        self._timer = context.window_manager.event_timer_add(_POLL_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC" or BakeGrating.job is None:
            self.cancel(context)
            self.report({"INFO"}, "Bake cancelled; nothing was changed")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if BakeGrating.job.running:
            stage, fraction = BakeGrating.job.progress()
            context.workspace.status_text_set(f"Baking {self._name}: {stage} {fraction:.0%}   [Esc] cancels")
            _redraw(context)
            return {"PASS_THROUGH"}
        job, BakeGrating.job = BakeGrating.job, None
        self._end_modal(context)
        return self._finish(job)

    def cancel(self, context):
        """Stop the bake. Blender calls this too when it opens another file or quits."""
        self._end_modal(context)
        stop_running_bake()

    def _finish(self, job: "Job"):
        from ..actions.bake import record_bake

        try:
            facts = job.result()
            scene = bpy.data.scenes.get(self._scene)
            grating = scene and scene.natural_gratings.items.get(self._name)
            if not grating:
                raise GratingError(f"{self._name}: no longer in the scene; its bake is {facts['files'][0]}")
            record_bake(grating, facts)
        except GratingError as error:
            return report_failure(self, error)
        return report_lines(self, [f"{grating.name}: {grating.bake_summary}"])

    def _end_modal(self, context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)
        _redraw(context)


def stop_running_bake() -> None:
    """Cancel the running bake, if there is one."""
    job, BakeGrating.job = BakeGrating.job, None
    if job is not None:
        job.cancel()


def _redraw(context) -> None:
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
