# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses where the active grating takes its direction from."""

import bpy
from bpy.props import EnumProperty, StringProperty

from ...precompute.base.failure import GratingError
from ..blender.guard import guarded_draw
from ..gratings.direction_source import AXES, AXIS, FRAME_MAP, KINDS, RADIAL, UV_MAP, DirectionSource
from ..gratings.grating import active_grating
from .polls import has_grating, in_object_mode
from .reports import report_failure, report_lines


class ChooseDirection(bpy.types.Operator):
    """Choose what the scan's x axis (left to right) follows on the meshes that show the active grating. The material's
    Rotation turns the scan further"""

    bl_idname = "grating.direction"
    bl_label = "Direction Source"
    bl_options = {"REGISTER", "UNDO"}

    kind: EnumProperty(name="Source", description="What the scan's x axis follows", items=KINDS)
    uv_map: StringProperty(name="UV Map", description="UV map whose U the scan's x axis follows")
    axis: EnumProperty(name="Axis", description="Axis of the object, in its local space", items=AXES, default="Z")
    frame_map: StringProperty(name="Direction Map", description="A picture made by Bake Direction Map")
    angle: StringProperty(
        name="Object Angle",
        description="Name of a custom property, such as grating_angle, that holds an angle in radians. It turns the "
        "scan on each object that has it, so that objects can share one material. Empty: no turn",
    )

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context) and has_grating(cls, context)

    @guarded_draw
    def draw(self, context):
        layout, thing = self.layout, context.object
        layout.prop(self, "kind")
        if self.kind == UV_MAP and thing is not None and thing.type == "MESH":
            layout.prop_search(self, "uv_map", thing.data, "uv_layers", icon="GROUP_UVS")
        elif self.kind == UV_MAP:
            layout.prop(self, "uv_map")
        elif self.kind in (RADIAL, AXIS):
            layout.prop(self, "axis")
        elif self.kind == FRAME_MAP:
            layout.prop_search(self, "frame_map", bpy.data, "images", icon="IMAGE_DATA")
        layout.prop(self, "angle")

    def invoke(self, context, event):
        """Show a dialog with the grating's present values."""
        source = active_grating(context.scene).frame_source()
        self.kind, self.uv_map, self.axis, self.angle = source.kind, source.uv_map, source.axis, source.angle
        self.frame_map = source.frame_map.name if source.frame_map else ""
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context):
        from ..workflow.choosing_direction import choose_frame

        image = bpy.data.images.get(self.frame_map)
        source = DirectionSource(self.kind, self.uv_map, self.axis, image, self.angle)
        try:
            return report_lines(self, [choose_frame(active_grating(context.scene), source)])
        except GratingError as error:
            return report_failure(self, error)
