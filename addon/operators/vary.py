# SPDX-License-Identifier: GPL-3.0-or-later
"""Varies the active grating from place to place: by a hologram's pattern, by paint, and by other gratings."""

from math import radians

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from ...precompute.base.failure import GratingError
from ..blender.guard import guarded_draw
from ..blender.session import has_window
from ..gratings.grating import ATTRIBUTE, PATTERNS, Variation, active_grating
from ..materials.holograms import patterns
from ..nodes.interface import Socket
from .shared import Acts, has_active_mesh, has_bake, has_grating, in_object_mode

INPUTS = (
    ("Strength", "Strength", "Black: no diffraction. White: the strength of the material"),
    ("Rotation", "Direction", "Grey: as it is. Black and white: turned by a quarter of a turn either way"),
    ("Period Scale", "Hue by Period", "Grey: as it is. Black: 0.8 times the period. White: 1.25 times"),
)
_MODES = {"ATTRIBUTE": "VERTEX_PAINT", "TEXTURE": "TEXTURE_PAINT", "GROUP": "WEIGHT_PAINT"}


def _field(socket: Socket):
    """A property of the operator for a pattern's input."""
    return FloatProperty(
        name=socket.name, description=socket.text, default=socket.default, min=socket.low, max=socket.high,
        subtype=socket.subtype or "NONE",  # type: ignore[arg-type]  # the stubs list the names
    )  # fmt: skip


# The name of the operator's property for each input.
FIELDS = {
    patterns.CELLS: "cells", patterns.TURN: "turn", patterns.SPREAD: "spread", patterns.SEED: "seed",
    patterns.TWIST: "twist", patterns.SECTORS: "sectors", patterns.CENTER_X: "center_x", patterns.CENTER_Y: "center_y",
    patterns.SHARDS: "shards", patterns.RANDOMNESS: "randomness", patterns.PICTURE_CELLS: "picture_cells",
    patterns.GREY_BELOW: "grey_below", patterns.SATURATED_PERIOD: "saturated_period",
}  # fmt: skip


class AddHologram(Acts, bpy.types.Operator):
    """Vary the direction and the period of the grating over the surface, as on a hologram or a foil. Acts on the
    selected meshes that show a grating, else on all that show the active one. Adjust its node in the material"""

    bl_idname = "grating.hologram"
    bl_label = "Hologram"
    bl_options = {"REGISTER", "UNDO"}

    pattern: EnumProperty(name="Pattern", description="How direction and period vary", items=patterns.PATTERNS)
    filepath: StringProperty(
        name="Picture",
        description="Its hue sets the direction, and its brightness the strength",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    filter_image: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_folder: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    uv_map: StringProperty(
        name="UV Map", description="UV map that the pattern follows. Empty: the map that renders", options={"SKIP_SAVE"}
    )

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context) and has_grating(cls, context)

    @guarded_draw
    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "pattern")
        if self.pattern == patterns.NONE:
            return
        if self.pattern == patterns.PICTURE:
            layout.prop(self, "filepath")
        for socket in patterns.OWN_INPUTS[self.pattern]:
            layout.prop(self, FIELDS[socket])
        layout.prop(self, "uv_map")

    def invoke(self, context, event):
        """Ask for the picture if the pattern needs one; the fields of all patterns are in the redo panel."""
        if self.pattern == patterns.PICTURE and not self.filepath:
            context.window_manager.fileselect_add(self)
            return {"RUNNING_MODAL"}
        return self.execute(context)

    def act(self, context):
        from ..workflow.varying_inputs import Hologram, add_hologram

        values = {socket.name: getattr(self, FIELDS[socket]) for socket in patterns.OWN_INPUTS.get(self.pattern, ())}
        choice = Hologram(self.pattern, values, picture=self.filepath, uv_map=self.uv_map)
        return add_hologram(context.scene, context.selected_objects, choice)


AddHologram.__annotations__.update({name: _field(socket) for socket, name in FIELDS.items()})


class PaintInput(Acts, bpy.types.Operator):
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

    def act(self, context):
        from ..workflow.varying_inputs import paint_input

        source = {"TEXTURE": self.image, "GROUP": self.group}.get(self.by, "")
        lines = paint_input(context.scene, context.active_object, self.input, by=self.by, source=source)
        if has_window() and context.mode == "OBJECT":
            bpy.ops.object.mode_set(mode=_MODES[self.by])  # type: ignore[arg-type]  # the stubs list the names
        return lines


class UnpaintInput(Acts, bpy.types.Operator):
    """Give a painted input its number back. What was painted stays on the mesh or in the texture"""

    bl_idname = "grating.unpaint"
    bl_label = "Unpaint"
    bl_options = {"REGISTER", "UNDO"}

    input: EnumProperty(name="Painted", description="What is painted", items=INPUTS)

    @classmethod
    def poll(cls, context):
        return has_bake(cls, context) and has_active_mesh(cls, context)

    def act(self, context):
        from ..workflow.varying_inputs import unpaint_input

        return unpaint_input(context.scene, context.active_object, self.input)


class VaryGrating(Acts, bpy.types.Operator):
    """Vary the active grating over all meshes that show it, as on a real skin: mix in other gratings in patches or from
    scale to scale, and slowly turn its direction"""

    bl_idname = "grating.vary"
    bl_label = "Variation"
    bl_options = {"REGISTER", "UNDO"}

    second: StringProperty(name="Second Grating", description="Grating to mix in. Empty: none")
    second_share: FloatProperty(
        name="Share", description="Share of the surface. The active grating gets the rest",
        default=0.33, min=0.0, max=1.0, subtype="FACTOR",
    )  # fmt: skip
    third: StringProperty(name="Third Grating", description="Another grating to mix in. Empty: none")
    third_share: FloatProperty(
        name="Share", description="Share of the surface. The active grating gets the rest",
        default=0.33, min=0.0, max=1.0, subtype="FACTOR",
    )  # fmt: skip
    pattern: EnumProperty(name="Pattern", description="How the gratings are spread over the surface", items=PATTERNS)
    attribute: StringProperty(
        name="Attribute", description="Mesh attribute with values from 0 to 1", default="scale_random"
    )
    softness: FloatProperty(
        name="Softness", description="How widely the gratings blend into each other. At 0 each point shows one. "
        "Above 0 samples may draw one at random, which is noisier", default=0.0, min=0.0, max=1.0, subtype="FACTOR",
    )  # fmt: skip
    turn: FloatProperty(
        name="Turn", description="Largest angle by which the direction turns to either side, slowly over the surface, "
        "in degrees", default=0.0, min=0.0, max=radians(90.0), subtype="ANGLE",
    )  # fmt: skip
    size_m: FloatProperty(
        name="Size", description="Width of the patches of gratings and of directions, in metres of the object's local "
        "space", default=0.02, min=1e-6, soft_min=1e-3, max=1e6, soft_max=10.0, subtype="DISTANCE",
    )  # fmt: skip

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context) and has_bake(cls, context)

    @guarded_draw
    def draw(self, context):
        layout, gratings = self.layout, context.scene.natural_gratings
        layout.use_property_split = True
        for name in ("second", "third"):
            column = layout.column(align=True)
            column.prop_search(self, name, gratings, "items", icon="TEXTURE")
            if getattr(self, name):
                column.prop(self, f"{name}_share")
        if self.second or self.third:
            layout.prop(self, "pattern")
            if self.pattern == ATTRIBUTE:
                layout.prop(self, "attribute")
            layout.prop(self, "softness")
        layout.prop(self, "turn")
        if self.turn or ((self.second or self.third) and self.pattern != ATTRIBUTE):
            layout.prop(self, "size_m")

    def invoke(self, context, event):
        """Show a dialog with the grating's present values."""
        from ..materials.group_properties import variation_of
        from ..workflow.making_materials import varied_with

        grating = active_grating(context.scene)
        if grating.group is not None:
            choice, others = variation_of(grating.group), varied_with(context.scene, grating)
            self.second, self.third = [*(other.name for other in others), "", ""][:2]
            self.second_share, self.third_share = [*choice.shares, 0.33, 0.33][:2]
            if choice != Variation():
                self.pattern, self.softness = choice.pattern, choice.softness
                self.attribute = choice.attribute or self.attribute
                self.turn, self.size_m = choice.turn, choice.size_m
        return context.window_manager.invoke_props_dialog(self)

    def act(self, context):
        from ..workflow.making_materials import vary

        chosen = [(n, share) for n, share in ((self.second, self.second_share), (self.third, self.third_share)) if n]
        choice = Variation(
            shares=tuple(share for _, share in chosen), pattern=self.pattern, attribute=self.attribute,
            softness=self.softness, turn=self.turn, size_m=self.size_m,
        )  # fmt: skip
        if not choice.shares and not choice.turn:
            choice = Variation()
        others = [self._named(context.scene, name) for name, _ in chosen]
        return vary(context.scene, active_grating(context.scene), choice, others=others)

    def _named(self, scene, name):
        items = scene.natural_gratings.items
        if name not in items:
            raise GratingError(name, "no such grating in the scene", f"there are {', '.join(items.keys())}")
        return items[name]
