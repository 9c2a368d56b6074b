# SPDX-License-Identifier: GPL-3.0-or-later
"""Sticks a piece of foil with a grating on a part of the active mesh."""

from math import radians

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from ...precompute.base.failure import GratingError
from .add_preset import presets
from .shared import has_active_mesh, in_object_mode, report_failure, report_lines

ACTIVE = "ACTIVE"
# Blender keeps no reference to the texts of a dynamic enumeration, so they are kept here. Made at the first use.
_items: list[tuple[str, str, str]] = []


def _surfaces(operator, context):
    """What a sticker can be made of."""
    if not _items:
        tooltip = "The grating that the panel shows; without one, the preset Security Hologram"
        _items.extend(((ACTIVE, "Active Grating", tooltip), *presets(operator, context)))
    return _items


class AddSticker(bpy.types.Operator):
    """Stick a piece of foil with a grating on the active mesh, where you look at it. The mesh keeps its materials. Move
    the sticker with G and scale it with S; it follows the surface"""

    bl_idname = "grating.add_sticker"
    bl_label = "Add Sticker"
    bl_options = {"REGISTER", "UNDO"}

    preset: EnumProperty(
        name="Surface", description="What the sticker is made of", items=_surfaces, options={"SKIP_SAVE"}
    )
    filepath: StringProperty(
        name="Picture",
        description="Its hue sets the direction of the pattern, and its brightness the strength. The sticker has its "
        "shape. Empty: the pattern of the surface",
        subtype="FILE_PATH",
        options={"SKIP_SAVE"},
    )
    filter_image: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    filter_folder: BoolProperty(default=True, options={"HIDDEN", "SKIP_SAVE"})
    from_picture: BoolProperty(options={"HIDDEN", "SKIP_SAVE"})
    size: FloatProperty(
        name="Size", description="Width of the sticker over that of the mesh as you see it", default=0.5, min=0.01,
        max=2.0, soft_max=1.0, subtype="FACTOR",
    )  # fmt: skip
    rotation: FloatProperty(
        name="Rotation", description="Turn of the sticker on the surface, counterclockwise", default=0.0,
        min=radians(-360), max=radians(360), subtype="ANGLE",
    )  # fmt: skip

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context) and has_active_mesh(cls, context)

    @classmethod
    def description(cls, context, properties):
        """The tooltip; of the button that asks for a picture, its own."""
        if properties.from_picture:
            return "Choose a picture, and stick a foil with it on the active mesh. Its hues light up one by one"
        return cls.__doc__

    def invoke(self, context, event):
        """Ask for the picture first if the button says so."""
        if self.from_picture and not self.filepath:
            context.window_manager.fileselect_add(self)
            return {"RUNNING_MODAL"}
        return self.execute(context)

    def execute(self, context):
        from ..workflow.adding_stickers import Sticker, add_sticker

        preset = "" if self.preset == ACTIVE else self.preset
        choice = Sticker(preset, self.filepath, size=self.size, rotation=self.rotation)
        view = getattr(context.space_data, "region_3d", None)
        try:
            return report_lines(self, add_sticker(context, context.active_object, choice, view=view))
        except GratingError as error:
            return report_failure(self, error)
