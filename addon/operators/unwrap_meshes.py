# SPDX-License-Identifier: GPL-3.0-or-later
"""Unwraps the active mesh into a new UV map."""

import time

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty

from ...precompute.base.failure import GratingError
from ..blender.guard import guarded_modal
from .polls import has_active_mesh, in_object_mode
from .reports import report_failure, report_lines

XATLAS, MINIMUM_STRETCH = "XATLAS", "MINIMUM_STRETCH"
_POLL_SECONDS = 0.2


class Unwrap(bpy.types.Operator):
    """Unwrap the active mesh into a new UV map without overlaps, for textures and direction maps. Its other UV maps
    stay, and its grating keeps its direction. Esc cancels"""

    bl_idname = "grating.unwrap"
    bl_label = "Unwrap"
    bl_options = {"UNDO"}

    method: EnumProperty(
        name="Method",
        description="How the islands are cut and flattened",
        items=(
            (XATLAS, "xatlas", "Cuts islands automatically. You can keep working meanwhile"),
            (MINIMUM_STRETCH, "Minimum Stretch", "Blender's own method, along the mesh's seams. Blender waits"),
        ),
    )
    size: IntProperty(
        name="Map Size", description="Side of the textures that will use the map, in pixels", default=1024, min=16,
        max=1 << 15,
    )  # fmt: skip
    padding: IntProperty(
        name="Padding", description="Space between islands, in pixels of Map Size", default=4, min=0, max=256
    )
    density: FloatProperty(
        name="Density", description="Pixels per metre of the surface. 0: as many as fit on the map", default=0.0,
        min=0.0, max=1e9,
    )  # fmt: skip

    # The running unwrap, if any. The panel shows it; disabling the extension stops it.
    running = None

    @classmethod
    def poll(cls, context):
        if Unwrap.running is not None:
            cls.poll_message_set("Wait until the running unwrap ends, or press Esc to cancel it")
            return False
        return in_object_mode(cls, context) and has_active_mesh(cls, context)

    def execute(self, context):
        """Unwrap and wait, for scripts."""
        from ..workflow.unwrapping import unwrap_and_wait, unwrap_by_blender

        mesh = context.active_object
        try:
            if self.method == MINIMUM_STRETCH:
                return report_lines(self, unwrap_by_blender(context, mesh, self._packing()))
            return report_lines(self, unwrap_and_wait(mesh, self._packing()))
        except GratingError as error:
            return report_failure(self, error)

    def invoke(self, context, event):
        """Start xatlas; modal() then follows it."""
        from ..workflow.unwrapping import Unwrapping

        if self.method == MINIMUM_STRETCH:
            return self.execute(context)
        try:
            Unwrap.running = Unwrapping(context.active_object, self._packing())
        except GratingError as error:
            return report_failure(self, error)
        self._begun = time.monotonic()
        self._timer = context.window_manager.event_timer_add(_POLL_SECONDS, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    @guarded_modal
    def modal(self, context, event):
        if event.type == "ESC" or Unwrap.running is None:
            self.cancel(context)
            self.report({"INFO"}, "Unwrap cancelled; nothing was changed")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        unwrapping = Unwrap.running
        if unwrapping.job.running:
            fraction, gone = unwrapping.job.progress()[1], time.monotonic() - self._begun
            told = f"Unwrapping {unwrapping.mesh_name}: about {fraction:.0%}, {gone:.0f} s   [Esc] cancels"
            context.workspace.status_text_set(told)
            return {"PASS_THROUGH"}
        Unwrap.running = None
        self._end_modal(context)
        try:
            return report_lines(self, unwrapping.finish())
        except GratingError as error:
            return report_failure(self, error)

    def cancel(self, context):
        """Stop the unwrap. Blender also calls this when it opens another file or quits."""
        self._end_modal(context)
        stop_running_unwrap()

    def _packing(self):
        from ...precompute.mesh.unwrap import Packing

        return Packing(self.size, self.padding, self.density)

    def _end_modal(self, context) -> None:
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)


def stop_running_unwrap() -> None:
    """Cancel the running unwrap, if any."""
    unwrapping, Unwrap.running = Unwrap.running, None
    if unwrapping is not None:
        unwrapping.cancel()
