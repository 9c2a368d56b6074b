# SPDX-License-Identifier: GPL-3.0-or-later
"""Varies the active grating over the meshes that show it."""

from math import radians

import bpy
from bpy.props import EnumProperty, FloatProperty, StringProperty

from ...precompute.base.failure import GratingError
from ..blender.guard import guarded_draw
from ..gratings.grating import ATTRIBUTE, PATTERNS, Variation, active_grating
from .shared import has_bake, in_object_mode, report_failure, report_lines


class VaryGrating(bpy.types.Operator):
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
        name="Softness", description="How widely the gratings blend into each other. At 0 each point shows only one "
        "of them, so Cycles renders as fast as with a single grating", default=0.0, min=0.0, max=1.0, subtype="FACTOR",
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

    def execute(self, context):
        from ..workflow.making_materials import vary

        chosen = [(n, share) for n, share in ((self.second, self.second_share), (self.third, self.third_share)) if n]
        choice = Variation(
            shares=tuple(share for _, share in chosen), pattern=self.pattern, attribute=self.attribute,
            softness=self.softness, turn=self.turn, size_m=self.size_m,
        )  # fmt: skip
        if not choice.shares and not choice.turn:
            choice = Variation()
        try:
            others = [self._named(context.scene, name) for name, _ in chosen]
            return report_lines(self, vary(context.scene, active_grating(context.scene), choice, others=others))
        except GratingError as error:
            return report_failure(self, error)

    def _named(self, scene, name):
        items = scene.natural_gratings.items
        if name not in items:
            raise GratingError(name, "no such grating in the scene", f"there are {', '.join(items.keys())}")
        return items[name]
