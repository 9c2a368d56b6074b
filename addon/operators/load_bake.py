# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds a grating from a bake that exists already, from the panel's menu or File > Import."""

import bpy
from bpy.props import StringProperty
from bpy_extras.io_utils import ImportHelper

from ..blender.guard import guarded
from .reports import report_added


class LoadBake(bpy.types.Operator, ImportHelper):  # type: ignore[misc]  # both bases define `check`
    """Add a grating from a bake that you made before, or that somebody gave you: choose its .exr or its folder"""

    bl_idname = "grating.load_bake"
    bl_label = "Load Bake"
    bl_options = {"REGISTER", "UNDO"}

    filter_glob: StringProperty(default="*.exr", options={"HIDDEN"})
    filepath: StringProperty(name="File", subtype="FILE_PATH", options={"HIDDEN", "SKIP_SAVE"})

    def invoke(self, context, event):
        # Start in the .blend's folder. Without this, the dialog would offer the .blend itself as the bake.
        self.filepath = self.filepath or bpy.path.abspath("//")
        return super().invoke(context, event)

    def execute(self, context):
        from ..workflow.loading_bakes import load_bake

        return report_added(self, lambda: load_bake(context.scene, bpy.path.abspath(self.filepath)))


@guarded
def menu_entry(menu, context):
    """Draw the entry in File > Import."""
    menu.layout.operator(LoadBake.bl_idname, text="Grating Bake (.exr)")
