# SPDX-License-Identifier: GPL-3.0-or-later
"""The sub-panel Direction: the grating's direction, UV maps and direction maps of the active mesh."""

import bpy

from ..blender.guard import guarded_draw
from ..gratings.wording import translated
from ..operators.direction import MINIMUM_STRETCH, XATLAS, BakeDirectionMap, ShowDirection, Unwrap
from ..operators.shared import draw_progress
from .notes import draw_note
from .panel import GratingPanel


class DirectionPanel(bpy.types.Panel):
    """Show the grating's direction, unwrap the active mesh, and bake its direction map"""

    bl_idname = "GRATING_PT_direction"
    bl_label = "Direction"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Grating"
    bl_parent_id = GratingPanel.bl_idname
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context):
        return context.scene.natural_gratings.active() is not None

    @guarded_draw
    def draw(self, context):
        settings = context.scene.natural_gratings
        self.layout.operator(ShowDirection.bl_idname, icon="ORIENTATION_LOCAL", depress=ShowDirection.on)
        if ShowDirection.fault:
            draw_note(self.layout, context, ShowDirection.fault, icon="ERROR")
        column = self.layout.column(align=True)
        column.prop(settings, "map_size")
        column.prop(settings, "map_padding")
        column.prop(settings, "map_density")
        _draw_unwrap(self.layout, context)
        button = self.layout.operator(BakeDirectionMap.bl_idname, icon="IMAGE_DATA")
        button.size, button.margin = min(settings.map_size, 1 << 14), max(2, settings.map_padding)


def _draw_unwrap(layout, context) -> None:
    from ...precompute.base.machine import missing_packages
    from ...precompute.mesh.unwrap import expected_seconds

    if Unwrap.job is not None:
        draw_progress(layout, Unwrap)
        return
    column, settings = layout.column(align=True), context.scene.natural_gratings
    labels = {MINIMUM_STRETCH: "Unwrap by Minimum Stretch"}
    if "xatlas" not in missing_packages():
        labels = {XATLAS: "Unwrap by xatlas"} | labels
    for method, label in labels.items():
        button = column.operator(Unwrap.bl_idname, text=translated(label), icon="UV")
        button.method, button.size = method, settings.map_size
        button.padding, button.density = settings.map_padding, settings.map_density
    if XATLAS in labels and context.active_object is not None and context.active_object.type == "MESH":
        mesh = context.active_object.data
        seconds = expected_seconds(len(mesh.loops) - 2 * len(mesh.polygons))
        layout.label(text=translated("xatlas takes about {time}", time=in_words(seconds)))


def in_words(seconds: float) -> str:
    """A rounded time with its unit."""
    for unit, size in (("h", 3600), ("min", 60)):
        if seconds >= size:
            return f"{seconds / size:.0f} {unit}"
    return f"{max(1, round(seconds))} s"
