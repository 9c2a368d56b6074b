# SPDX-License-Identifier: GPL-3.0-or-later
"""Unwraps the active mesh into a new UV map."""

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty

from ...precompute.base.failure import GratingError
from .follows_job import FollowsJob
from .polls import has_active_mesh, in_object_mode
from .reports import report_failure, report_lines

XATLAS, MINIMUM_STRETCH = "XATLAS", "MINIMUM_STRETCH"


class Unwrap(FollowsJob, bpy.types.Operator):
    """Unwrap the active mesh into a new UV map without overlaps, for textures and direction maps. Its other UV maps
    stay, and its grating keeps its direction"""

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

    @classmethod
    def poll(cls, context):
        if Unwrap.job is not None:
            cls.poll_message_set("Wait until the running unwrap ends, or cancel it")
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
            self._unwrapping = Unwrapping(context.active_object, self._packing())
        except GratingError as error:
            return report_failure(self, error)
        return self.follow(context, self._unwrapping.job, f"Unwrapping {self._unwrapping.mesh_name}")

    def finish(self, job):
        """Add the new UV map."""
        try:
            return report_lines(self, self._unwrapping.finish())
        except GratingError as error:
            return report_failure(self, error)

    def _packing(self):
        from ...precompute.mesh.unwrap import Packing

        return Packing(self.size, self.padding, self.density)
