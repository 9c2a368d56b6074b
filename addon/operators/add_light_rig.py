# SPDX-License-Identifier: GPL-3.0-or-later
"""Adds lamps where they make the camera see a grating's colours."""

import bpy
from bpy.props import EnumProperty, FloatProperty

from ...precompute.base.failure import GratingError
from .polls import in_object_mode
from .reports import report_failure, report_lines

KINDS = (
    ("SUN", "Sun", "One small sun: crisp, saturated colours"),
    ("STUDIO", "Studio", "A soft box, a weaker one from another side, and a weak fill beside the camera"),
    ("WINDOW", "Window", "One tall soft lamp, and a weak bounce from the other side"),
    ("ORDERS", "Orders", "Up to three wide suns that show colour at the most places, as strong as the colours need"),
    ("GRID", "Softbox with Grid", "A soft spot that lights the object and little of the ground, and a weak fill"),
    ("FLASH", "Flash", "One small lamp beside the camera's lens, on the side that shows the most colour"),
    ("POINTS", "Two Points", "Two small point lamps, for a dark scene"),
)


class AddLightRig(bpy.types.Operator):
    """Add lamps at the angles that show most colour to the camera, or to this view, and switch the view to Rendered.
    It lights the active object if it has a grating, else all objects with one. A metal in a dim world also gets cards
    to reflect. Pressed again, it replaces its own lamps and keeps all other lamps and the world"""

    bl_idname = "grating.light_rig"
    bl_label = "Light Rig"
    bl_options = {"REGISTER", "UNDO"}

    kind: EnumProperty(name="Kind", description="The lamps of the rig", items=KINDS)
    seen_from: EnumProperty(
        name="Seen From",
        description="From where the rig looks for colours",
        items=(
            ("CAMERA", "Camera", "The scene's camera; the 3D view if the scene has none"),
            ("VIEW", "This View", "The 3D view as it looks now"),
        ),
        options={"SKIP_SAVE"},
    )
    strength: FloatProperty(
        name="Strength",
        description="Multiplies the strength of all lamps. At 1, a 50 % grey surface that faces the brightest lamp "
        "has a brightness of 0.4",
        default=1.0,
        min=0.0,
        max=1e4,
        soft_max=10.0,
    )
    softness: FloatProperty(
        name="Softness",
        description="Multiplies the size of all lamps. Larger lamps give softer shadows and paler colours",
        default=1.0,
        min=0.01,
        max=10.0,
        soft_min=0.1,
        soft_max=4.0,
    )

    @classmethod
    def poll(cls, context):
        return in_object_mode(cls, context)

    def invoke(self, context, event):
        """Choose what the artist looks through, and show it rendered."""
        view = _view(context)
        if view is not None and view.view_perspective != "CAMERA":
            self.seen_from = "VIEW"
        done = self.execute(context)
        if view is not None and done == {"FINISHED"}:
            context.space_data.shading.type = "RENDERED"
        return done

    def execute(self, context):
        from ..workflow.adding_light_rigs import Rig, add_light_rig, carriers

        scene = context.scene
        try:
            lines = add_light_rig(
                scene, context.evaluated_depsgraph_get(), Rig(self.kind, self.strength, self.softness),
                objects=carriers(scene, context.active_object),
                view=_view(context), from_view=self.seen_from == "VIEW",
            )  # fmt: skip
        except GratingError as error:
            return report_failure(self, error)
        return report_lines(self, lines)


def _view(context: bpy.types.Context) -> bpy.types.RegionView3D | None:
    """How the 3D view looks at the scene; None in another editor. A button of the sidebar has no region_data."""
    return getattr(context.space_data, "region_3d", None)
