# SPDX-License-Identifier: GPL-3.0-or-later
"""Paints the strength, the direction or the period of the grating on the active mesh."""

import bpy
from bpy.props import EnumProperty, StringProperty

from ...precompute.base.failure import GratingError
from ..blender.guard import guarded_draw
from .shared import has_active_mesh, has_bake, report_failure, report_lines

INPUTS = (
    ("Strength", "Strength", "Black: no diffraction. White: the strength of the material"),
    ("Rotation", "Direction", "Grey: as it is. Black and white: turned by a quarter of a turn either way"),
    ("Period Scale", "Hue by Period", "Grey: as it is. Black: 0.8 times the period. White: 1.25 times"),
)
_MODES = {"ATTRIBUTE": "VERTEX_PAINT", "TEXTURE": "TEXTURE_PAINT", "GROUP": "WEIGHT_PAINT"}


class PaintInput(bpy.types.Operator):
    """Paint the strength, the direction or the hue of the grating on the active mesh, with Blender's brushes"""

    bl_idname = "grating.paint"
    bl_label = "Paint"
    bl_options = {"REGISTER", "UNDO"}

    input: EnumProperty(name="Paint", description="What is painted", items=INPUTS)
    by: EnumProperty(
        name="On",
        description="Where the strokes are kept",
        items=(
            ("ATTRIBUTE", "Vertices", "A colour attribute: as fine as the mesh, and needs no UV map"),
            ("TEXTURE", "Texture", "A texture on the UV map that renders: a new one of 1024 x 1024 pixels, or yours"),
            ("GROUP", "Vertex Group", "Weights of the mesh's vertices: a new vertex group, or yours"),
        ),
    )
    image: StringProperty(
        name="Texture", description="Texture that is the mask. Empty: a new one", options={"SKIP_SAVE"}
    )
    group: StringProperty(
        name="Vertex Group", description="Vertex group that is the mask. Empty: a new one", options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context):
        return has_bake(cls, context) and has_active_mesh(cls, context)

    def invoke(self, context, event):
        return context.window_manager.invoke_props_dialog(self)

    @guarded_draw
    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "input")
        layout.prop(self, "by")
        if self.by == "TEXTURE":
            layout.prop_search(self, "image", bpy.data, "images")
        elif self.by == "GROUP":
            layout.prop_search(self, "group", context.active_object, "vertex_groups")

    def execute(self, context):
        from ..blender.session import has_window
        from ..workflow.painting_inputs import paint_input

        try:
            source = {"TEXTURE": self.image, "GROUP": self.group}.get(self.by, "")
            lines = paint_input(context.scene, context.active_object, self.input, by=self.by, source=source)
        except GratingError as error:
            return report_failure(self, error)
        if has_window() and context.mode == "OBJECT":
            bpy.ops.object.mode_set(mode=_MODES[self.by])  # type: ignore[arg-type]  # the stubs list the names
        return report_lines(self, lines)


class UnpaintInput(bpy.types.Operator):
    """Give a painted input its number back. What was painted stays on the mesh or in the texture"""

    bl_idname = "grating.unpaint"
    bl_label = "Unpaint"
    bl_options = {"REGISTER", "UNDO"}

    input: EnumProperty(name="Painted", description="What is painted", items=INPUTS)

    @classmethod
    def poll(cls, context):
        return has_bake(cls, context) and has_active_mesh(cls, context)

    def execute(self, context):
        from ..workflow.painting_inputs import unpaint_input

        try:
            return report_lines(self, unpaint_input(context.scene, context.active_object, self.input))
        except GratingError as error:
            return report_failure(self, error)
