# SPDX-License-Identifier: GPL-3.0-or-later
"""The base class of the operators that work on the selected meshes."""

import bpy

from ...precompute.base.failure import GratingError
from .polls import OperatorMixin, has_bake, has_selected_mesh, in_object_mode
from .reports import report_failure, report_lines


class OnSelectedMeshes(OperatorMixin):
    """An operator that puts a grating on the selected meshes. A subclass adds `put`."""

    def put(self, scene: bpy.types.Scene, things: list[bpy.types.Object]) -> list[str]:
        """For subclasses: put the grating on the meshes among the objects. Returns lines to report. Raises
        GratingError."""
        raise NotImplementedError

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context) and has_bake(cls, context) and has_selected_mesh(cls, context)

    def execute(self, context):
        try:
            return report_lines(self, self.put(context.scene, context.selected_objects))
        except GratingError as error:
            return report_failure(self, error)
