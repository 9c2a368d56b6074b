# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel: 3D View > Sidebar > Grating, from top to bottom in the order of the work."""

import bpy

from ..precompute.failure import GratingError
from ..precompute.samples import SAMPLES
from . import key_light
from .operators.assign import AssignToSelected
from .operators.bake_grating import BakeGrating
from .operators.import_height_map import ImportHeightMap
from .operators.new_material import NewDiffractionMaterial
from .operators.remove_grating import RemoveGrating


class SampleMenu(bpy.types.Menu):
    """Surfaces that come with the extension"""

    bl_idname = "GRATING_MT_samples"
    bl_label = "Add Sample"

    def draw(self, context):
        self.layout.operator_context = "EXEC_DEFAULT"
        for name in SAMPLES:
            entry = self.layout.operator(ImportHeightMap.bl_idname, text=name.capitalize())
            entry.filepath = f"sample:{name}"


class GratingList(bpy.types.UIList):
    """The scene's gratings"""

    bl_idname = "GRATING_UL_gratings"

    def draw_item(self, context, layout, data, item, icon, active_data, active_property):
        layout.prop(item, "name", text="", emboss=False, icon="TEXTURE" if item.bake_path else "IMAGE_DATA")


class GratingPanel(bpy.types.Panel):
    """Import, bake, assign"""

    bl_idname = "GRATING_PT_main"
    bl_label = "Natural Gratings"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Grating"

    def draw(self, context):
        layout = self.layout
        gratings = context.scene.natural_gratings
        row = layout.row()
        row.template_list(GratingList.bl_idname, "", gratings, "items", gratings, "active_index", rows=3)
        buttons = row.column(align=True)
        buttons.operator(ImportHeightMap.bl_idname, text="", icon="ADD")
        buttons.menu(SampleMenu.bl_idname, text="", icon="DOWNARROW_HLT")
        buttons.operator(RemoveGrating.bl_idname, text="", icon="REMOVE")
        grating = gratings.active()
        if grating is None:
            layout.label(text="Import a height map, or add a sample", icon="INFO")
            return
        _draw_bake(layout, grating)
        _draw_material(layout, context)


def _draw_bake(layout, grating) -> None:
    _draw_lines(layout, grating.summary)
    settings = layout.column()
    settings.use_property_split = True
    settings.use_property_decorate = False
    settings.prop(grating, "delta_e")
    settings.prop(grating, "coherence_um", text="Coherence (um)" if grating.coherence_um else "Coherence (auto)")
    if BakeGrating.job is not None:
        stage, fraction = BakeGrating.job.progress()
        layout.progress(factor=fraction, text=f"{stage} (Esc cancels)")
    else:
        layout.operator(BakeGrating.bl_idname, icon="RENDER_STILL")
    _draw_lines(layout, grating.bake_summary)


def _draw_lines(layout, summary: str) -> None:
    """A summary, a line for each of its facts: the sidebar is narrow."""
    column = layout.column(align=True)
    for fact in filter(None, summary.split(", ")):
        column.label(text=fact)


def _draw_material(layout, context) -> None:
    column = layout.column(align=True)
    column.operator(NewDiffractionMaterial.bl_idname, icon="MATERIAL")
    column.operator(AssignToSelected.bl_idname, icon="BRUSH_DATA")
    try:
        layout.label(text=f"Lit by {key_light.find_sun(context.scene).name}", icon="LIGHT_SUN")
    except GratingError:
        layout.label(text="No sun in the scene: add one", icon="ERROR")
    note = layout.column(align=True)
    note.active = False
    note.label(text="Diffraction is lit by that sun alone,")
    note.label(text="and no object shades it yet.")
