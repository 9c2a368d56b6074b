# SPDX-License-Identifier: GPL-3.0-or-later
"""Shows the active grating as a picture in the Image Editor: its heights, its spectrum, or the chart of its colours."""

import bpy
from bpy.props import EnumProperty, FloatProperty

from ..blender.guard import guarded_draw
from ..gratings.grating import active_grating
from .shared import Acts, has_grating

# As in workflow/rendering_pictures.py, which is not loaded when Blender starts.
KINDS = (
    ("HEIGHT", "Height Map", "The levelled height map in grey: high is bright"),
    (
        "SPECTRUM",
        "Spectrum",
        "The fineness and the direction of the surface's lines, in lines per millimetre. Rings bound the lines that "
        "show colours",
    ),
    (
        "CHART",
        "Chart",
        "Which colour goes where, for light from one angle. The middle of the disc is a view from above, its rim one "
        "along the surface. The strip shows the views in the plane of the light",
    ),
)


class ShowPicture(Acts, bpy.types.Operator):
    """Show the grating as a picture in the Image Editor"""

    bl_idname = "grating.show_picture"
    bl_label = "Show Picture"
    bl_options = {"REGISTER", "UNDO"}

    kind: EnumProperty(name="Picture", description="What the picture shows", items=KINDS)
    light_deg: FloatProperty(
        name="Angle of Light", description="Angle of the light from the normal in degrees, for the chart", default=45.0,
        min=0.0, max=89.0,
    )  # fmt: skip

    @classmethod
    def description(cls, context, properties):
        return next(text for name, _, text in KINDS if name == properties.kind)

    @classmethod
    def poll(cls, context):
        return has_grating(cls, context)

    @guarded_draw
    def draw(self, context):
        self.layout.prop(self, "kind")
        if self.kind == "CHART":
            self.layout.prop(self, "light_deg")

    def act(self, context):
        from ..workflow.rendering_pictures import show_picture

        if context.window is not None:
            context.window.cursor_set("WAIT")
        try:
            return show_picture(active_grating(context.scene), self.kind, self.light_deg)
        finally:
            if context.window is not None:
                context.window.cursor_set("DEFAULT")
