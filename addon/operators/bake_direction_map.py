# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes the direction of the active mesh's grating into a picture."""

from pathlib import Path

import bpy
from bpy.props import BoolProperty, IntProperty, StringProperty

from ...precompute.base.failure import GratingError
from .polls import has_active_mesh, in_object_mode
from .reports import report_failure, report_lines


class BakeDirectionMap(bpy.types.Operator):
    """Bake the direction of the active mesh's grating into a picture on its active UV map, with Cycles, and make the
    grating read it. For game engines, and to speed up a slow direction source"""

    bl_idname = "grating.bake_direction_map"
    bl_label = "Bake Direction Map"
    bl_options = {"UNDO"}

    uv_map: StringProperty(name="UV Map", description="UV map to bake onto. Empty: the active one")
    size: IntProperty(name="Size", description="Side of the picture, in pixels", default=1024, min=16, max=1 << 14)
    margin: IntProperty(
        name="Margin", description="Bleed past the borders of UV islands, in pixels", default=8, min=2, max=64
    )
    filepath: StringProperty(
        name="File", description="Also save the picture here, as OpenEXR. It is always packed into the .blend",
        subtype="FILE_PATH",
    )  # fmt: skip
    read: BoolProperty(name="Use Picture", description="Make the mesh's gratings use the picture", default=True)

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
