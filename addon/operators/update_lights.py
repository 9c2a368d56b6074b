# SPDX-License-Identifier: GPL-3.0-or-later
"""Let diffraction follow the lamps that the scene has now."""

import bpy

from ...precompute.base.failure import GratingError
from ..lamps.find import instanced_lamps, instances_are_not_followed, unfollowed_features
from ..lamps.follow import follow_lamps
from ..materials.skin import linked_with_fewer_lamps, show_lamps


class UpdateLights(bpy.types.Operator):
    """Let diffraction follow the lamps that the scene has now. Needed after lamps were added, removed, linked to
    objects, made another kind or moved between collections; what else is done to a lamp is followed by itself"""

    bl_idname = "grating.update_lights"
    bl_label = "Update Lights"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context):
        try:
            lamps = follow_lamps(context.scene)
        except GratingError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        show_lamps()
        self.report({"INFO"}, f"lit by {', '.join(lamp.name for lamp in lamps)}")
        for line in unfollowed_features(context.scene) + linked_with_fewer_lamps(context.scene):
            self.report({"WARNING"}, line)
        instanced = instanced_lamps(context.evaluated_depsgraph_get())
        if instanced:
            self.report({"WARNING"}, instances_are_not_followed(instanced))
        return {"FINISHED"}
