# SPDX-License-Identifier: GPL-3.0-or-later
"""The base class of the operators that work on the selected meshes."""

import bpy

from ...precompute.base.failure import GratingError


class OnSelectedMeshes:
    """An operator that puts a grating on the selected meshes.

    A subclass adds `put`, which puts the grating on the meshes and returns one line on what was done, or raises
    GratingError."""

    @classmethod
    def poll(cls, context):
        return poll_meshes(cls, context)

    def execute(self, context):
        try:
            report = self.put(context.scene, context.selected_objects)
        except GratingError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self.report({"INFO"}, report)
        return {"FINISHED"}


def poll_meshes(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Whether there is a baked grating, and a selected mesh to put it on. If not, the button says what is missing."""
    grating = context.scene.natural_gratings.active()
    if grating is None or not grating.bake_path:
        operator.poll_message_set("Bake a grating first")
        return False
    if not any(o.type == "MESH" for o in context.selected_objects):
        operator.poll_message_set("Select a mesh first")
        return False
    return True
