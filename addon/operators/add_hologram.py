# SPDX-License-Identifier: GPL-3.0-or-later
"""Gives a grating's material a hologram's pattern."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, StringProperty

from ...precompute.base.failure import GratingError
from ..blender.guard import guarded_draw
from ..materials.holograms import patterns
from ..nodes.interface import Socket
from .shared import has_grating, in_object_mode, report_failure, report_lines


def _field(socket: Socket):
    """A property of the operator for a pattern's input."""
    return FloatProperty(
        name=socket.name, description=socket.text, default=socket.default, min=socket.low, max=socket.high,
        subtype=socket.subtype or "NONE",  # type: ignore[arg-type]  # the stubs list the names
    )  # fmt: skip


# The operator's property for each input.
FIELDS = {
    patterns.CELLS: "cells", patterns.TURN: "turn", patterns.SPREAD: "spread", patterns.SEED: "seed",
    patterns.TWIST: "twist", patterns.SECTORS: "sectors", patterns.CENTER_X: "center_x", patterns.CENTER_Y: "center_y",
    patterns.SHARDS: "shards", patterns.RANDOMNESS: "randomness", patterns.PICTURE_CELLS: "picture_cells",
    patterns.GREY_BELOW: "grey_below", patterns.SATURATED_PERIOD: "saturated_period",
}  # fmt: skip


class AddHologram(bpy.types.Operator):
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
    cells: _field(patterns.CELLS)
    turn: _field(patterns.TURN)
    spread: _field(patterns.SPREAD)
    seed: _field(patterns.SEED)
    twist: _field(patterns.TWIST)
    sectors: _field(patterns.SECTORS)
    center_x: _field(patterns.CENTER_X)
    center_y: _field(patterns.CENTER_Y)
    shards: _field(patterns.SHARDS)
    randomness: _field(patterns.RANDOMNESS)
    picture_cells: _field(patterns.PICTURE_CELLS)
    grey_below: _field(patterns.GREY_BELOW)
    saturated_period: _field(patterns.SATURATED_PERIOD)

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

    def execute(self, context):
        from ..workflow.adding_holograms import Hologram, add_hologram

        values = {socket.name: getattr(self, FIELDS[socket]) for socket in patterns.OWN_INPUTS.get(self.pattern, ())}
        choice = Hologram(self.pattern, values, picture=self.filepath, uv_map=self.uv_map)
        try:
            return report_lines(self, add_hologram(context.scene, context.selected_objects, choice))
        except GratingError as error:
            return report_failure(self, error)
