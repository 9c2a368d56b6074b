# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows a preset in a new scene, and returns to the artist's scene."""

import bpy
from bpy.props import EnumProperty

from ...precompute.base.failure import GratingError
from .add_preset import presets
from .shared import in_object_mode, report_failure, report_lines


class ShowMe(bpy.types.Operator):
    """Show a preset in a new scene with its own lamps, camera and rendered view. Your scene stays as it is"""

    bl_idname = "grating.show_me"
    bl_label = "Show Me"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(name="Preset", description="Ready-made surface to show", items=presets)

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context)

    def execute(self, context):
        from ..workflow.presets import show_preset, switch_to

        try:
            scene = show_preset(self.preset)
        except GratingError as error:
            return report_failure(self, error)
        switch_to(context, scene)
        return report_lines(self, [f"{scene.name}: a new scene; your scene is unchanged"])


class BackFromShow(bpy.types.Operator):
    """Return to the scene that was open before Show Me. The show's scene stays in the file"""

    bl_idname = "grating.back_from_show"
    bl_label = "Back to My Scene"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        from ..workflow.presets import scene_before

        if scene_before(context) is None:
            cls.poll_message_set("Add a scene to return to first")
            return False
        return True

    def execute(self, context):
        from ..workflow.presets import scene_before, switch_to

        scene = scene_before(context)
        if scene is not None:
            switch_to(context, scene)
        return {"FINISHED"}
