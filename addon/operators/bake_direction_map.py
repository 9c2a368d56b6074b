# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake the direction of the active mesh's grating into a picture."""

from pathlib import Path

import bpy
from bpy.props import BoolProperty, IntProperty, StringProperty

from ...precompute.base.failure import GratingError
from .polls import has_active_mesh, in_object_mode
from .reports import report_failure, report_lines


class BakeDirectionMap(bpy.types.Operator):
    """Bake the direction of the active mesh's grating into a picture on its active UV map, by Cycles, and have the
    grating read it: for game engines, and where the frame's own nodes are slow"""

    bl_idname = "grating.bake_direction_map"
    bl_label = "Bake Direction Map"
    bl_options = {"UNDO"}

    uv_map: StringProperty(name="UV Map", description="The map on which the picture lies; empty for the active one")
    size: IntProperty(name="Size", description="Side of the picture, in pixels", default=1024, min=16, max=1 << 14)
    margin: IntProperty(
        name="Margin", description="How far the islands grow past their rims, in pixels", default=8, min=2, max=64
    )
    filepath: StringProperty(
        name="File", description="Where the picture is written too, as OpenEXR; it is packed into the .blend anyway",
        subtype="FILE_PATH",
    )  # fmt: skip
    read: BoolProperty(name="Read", description="The mesh's gratings take their direction from it", default=True)

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context) and has_active_mesh(cls, context)

    def execute(self, context):
        from ..workflow.baking_direction_maps import bake_direction_map

        path = Path(bpy.path.abspath(self.filepath)) if self.filepath else None
        settings = {"uv_map": self.uv_map, "size": self.size, "margin": self.margin, "path": path, "read": self.read}
        try:
            return report_lines(self, bake_direction_map(context, context.active_object, **settings))
        except GratingError as error:
            return report_failure(self, error)
