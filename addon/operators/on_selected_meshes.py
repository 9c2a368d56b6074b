# SPDX-License-Identifier: GPL-3.0-or-later
"""The base class of the operators that work on the selected meshes."""

import bpy

from ...precompute.base.failure import GratingError
from .report import report_failure, report_lines


class OnSelectedMeshes:
    """An operator that puts a grating on the selected meshes.

    A subclass adds `put`, which puts the grating on the meshes among the objects and returns one line on what was done
    and further lines of warning, or raises GratingError."""

    @classmethod
    def poll(cls, context):
        return poll_meshes(cls, context)

    def execute(self, context):
        try:
            return report_lines(self, self.put(context.scene, context.selected_objects))
        except GratingError as error:
            return report_failure(self, error)


def poll_meshes(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether there is a baked grating, and a selected mesh to put it on. If not, the button says what is missing."""
    grating = context.scene.natural_gratings.active()
    if grating is None or not grating.bake_path:
        operator.poll_message_set("Bake a grating first")
        return False
    if not any(o.type == "MESH" for o in context.selected_objects):
        from ..actions.meshes import no_meshes

        operator.poll_message_set("; ".join(no_meshes(context.selected_objects)) or "Select a mesh first")
        return False
    return True
