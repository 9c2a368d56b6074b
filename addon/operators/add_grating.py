# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds a grating by its parameters, without a scan, and removes a grating from the list."""

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty

from ..blender.guard import guarded, guarded_draw
from ..gratings.grating import scan_record
from .shared import Acts, has_grating

# As in precompute/surface/generated/kinds.py, which is not loaded when Blender starts.
_KINDS = (
    ("SINUSOIDAL", "Sinusoidal", "Lines with the profile of a sine"),
    ("BINARY", "Binary", "Flat ridges with steep sides"),
    ("BLAZED", "Blazed", "Slanted facets that send most light to one side"),
    ("ECHELLE", "Echelle", "Coarse facets with a right angle, for high orders"),
    ("CROSSED", "Crossed", "Square posts in a square lattice"),
    ("HEXAGONAL", "Hexagonal", "Round bumps in a hexagonal lattice; the period is the distance between its rows"),
    ("BRUSHED", "Brushed", "Random scratches, as on brushed metal"),
    ("PITS", "Pits", "Pits of a disc in tracks"),
    ("GROOVE", "Groove", "Grooves of a record that swing sideways with the sound"),
)


@guarded
def _kind_chosen(operator):
    _take_defaults(operator)


def _take_defaults(operator, kept=()):
    """Fill the fields, except those that are `kept`, with the defaults of the chosen kind."""
    for name, value in _kind_of(operator).defaults.items():
        if name not in kept:
            setattr(operator, name, int(value) if name == "seed" else value)


def _kind_of(operator):
    from ...precompute.surface.generated.kinds import KINDS

    return KINDS[operator.kind.lower()]


class AddGrating(Acts, bpy.types.Operator):
    """Add a grating by its period, depth and disorder to the scene's gratings. It needs no scan"""

    bl_idname = "grating.add_grating"
    bl_label = "Grating by Parameters"
    bl_options = {"REGISTER", "UNDO"}

    # SKIP_SAVE: the dialog begins with the defaults of its kind.
    kind: EnumProperty(
        name="Kind", description="Shape of the surface. Choosing a kind sets its other fields to their defaults",
        items=_KINDS, default="BLAZED", update=lambda operator, _: _kind_chosen(operator), options={"SKIP_SAVE"},
    )  # fmt: skip
    period_um: FloatProperty(
        name="Period (um)", description="Distance between neighbouring lines, in micrometres",
        default=2.5, min=0.2, max=20.0, precision=3, options={"SKIP_SAVE"},
    )  # fmt: skip
    lines_per_mm: FloatProperty(
        name="Lines per mm", description="Number of lines in a millimetre. It follows the period, and sets it",
        min=50.0, max=5000.0, precision=1, options={"SKIP_SAVE"},
        get=lambda operator: 1000 / operator.period_um,
        set=lambda operator, lines: setattr(operator, "period_um", 1000 / lines),
    )  # fmt: skip
    depth_nm: FloatProperty(
        name="Depth (nm)", description="Height from the lowest to the highest point of a line, in nanometres",
        default=246.23, min=1.0, max=5000.0, precision=1, options={"SKIP_SAVE"},
    )  # fmt: skip
    angle_deg: FloatProperty(
        name="Blaze Angle (deg)", description="Slope of the long facets, in degrees. It sets the depth",
        default=10.0, min=1.0, max=45.0, options={"SKIP_SAVE"},
    )  # fmt: skip
    duty: FloatProperty(
        name="Duty", description="Width of the ridge, pit or groove, as a fraction of the period",
        default=0.5, min=0.05, max=0.95, subtype="FACTOR", options={"SKIP_SAVE"},
    )  # fmt: skip
    bit_nm: FloatProperty(
        name="Channel Bit (nm)",
        description="Length of a channel bit along the track, in nanometres. Pits are 3 to 11 bits long",
        default=277.5, min=20.0, max=1000.0, precision=1, options={"SKIP_SAVE"},
    )  # fmt: skip
    roundness: FloatProperty(
        name="Roundness", description="Shape of the groove, from a V (0) to a cosine (1)",
        default=0.0, min=0.0, max=1.0, subtype="FACTOR", options={"SKIP_SAVE"},
    )  # fmt: skip
    modulation_nm: FloatProperty(
        name="Swing (nm)", description="Largest sideways swing of a groove, in nanometres",
        default=300.0, min=0.0, max=5000.0, precision=1, options={"SKIP_SAVE"},
    )  # fmt: skip
    wave_um: FloatProperty(
        name="Wave (um)",
        description="Shortest wave of the sound along the groove, in micrometres. The longest is 8 times as long",
        default=4.0, min=0.4, max=50.0, options={"SKIP_SAVE"},
    )  # fmt: skip
    period_disorder: FloatProperty(
        name="Period Disorder", description="Variation (standard deviation) of the period, as a fraction of it",
        default=0.0, min=0.0, max=0.5, options={"SKIP_SAVE"},
    )  # fmt: skip
    depth_disorder: FloatProperty(
        name="Depth Disorder", description="Variation (standard deviation) of the depth, as a fraction of it",
        default=0.0, min=0.0, max=1.0, options={"SKIP_SAVE"},
    )  # fmt: skip
    direction_disorder_deg: FloatProperty(
        name="Direction Disorder (deg)", description="Variation (standard deviation) of the direction, in degrees",
        default=0.0, min=0.0, max=45.0, options={"SKIP_SAVE"},
    )  # fmt: skip
    seed: IntProperty(
        name="Seed", description="Number that chooses the random values of the disorder, the pits or the sound",
        default=0, min=0, options={"SKIP_SAVE"},
    )  # fmt: skip

    @guarded_draw
    def draw(self, context):
        """Draw the fields that the kind has."""
        layout = self.layout
        layout.use_property_split = True
        layout.prop(self, "kind")
        for name in _kind_of(self).defaults:
            layout.prop(self, name)
            if name == "period_um":
                layout.prop(self, "lines_per_mm")

    def invoke(self, context, event):
        """Show a dialog. Fields that the caller has not set begin with the kind's defaults."""
        _take_defaults(self, kept=[name for name in _kind_of(self).defaults if self.properties.is_property_set(name)])
        return context.window_manager.invoke_props_dialog(self, width=360)

    def act(self, context):
        from ...precompute.surface.generated.parameters import text_of
        from ..workflow.importing import import_scans

        # Fields hold single precision; seven digits restore the number that the user typed.
        given = {n: getattr(self, n) for n in _kind_of(self).defaults if self.properties.is_property_set(n)}
        values = {name: value if name == "seed" else float(f"{value:.7g}") for name, value in given.items()}
        record = scan_record(text_of(self.kind.lower(), values), 0.0, 0.0, channel="")
        return import_scans(context.scene, [record])


class RemoveGrating(bpy.types.Operator):
    """Remove the active grating from the list. Its materials and its bake stay"""

    bl_idname = "grating.remove"
    bl_label = "Remove Grating"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return has_grating(cls, context)

    def execute(self, context):
        from ..workflow.lights.fitting_worlds import forget_unread_sources

        gratings = context.scene.natural_gratings
        gratings.items.remove(gratings.active_index)
        gratings.active_index = min(gratings.active_index, max(len(gratings.items) - 1, 0))
        forget_unread_sources()
        return {"FINISHED"}
