# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel 3D View > Sidebar > Grating, in the order of the work from top to bottom."""

import bpy

from ..blender import compat, stored
from ..blender.guard import guarded_draw, guarded_item
from ..gratings.direction_source import FRAMES, KINDS, STORED
from ..gratings.lights_choice import ALL, LAMPS_ONLY, LIGHTS, REST
from ..gratings.matter_fields import LAYERS
from ..gratings.wording import in_words
from ..operators.add_diffraction import AddDiffraction
from ..operators.add_diffraction_lamp import AddDiffractionLamp
from ..operators.add_grating import AddGrating
from ..operators.add_hologram import AddHologram
from ..operators.add_preset import AddPreset
from ..operators.add_sun import AddSun
from ..operators.adopt import AdoptMaterials
from ..operators.assign import AssignToSelected
from ..operators.bake_grating import BakeGrating
from ..operators.bake_needs import BakeNeeds
from ..operators.choose_direction import ChooseDirection
from ..operators.choose_lights import ChooseLights
from ..operators.comb_grating import CombGrating
from ..operators.fit_world import FitWorld
from ..operators.follows_bake import running_bake
from ..operators.import_height_map import ImportHeightMap
from ..operators.mend import MendMaterials
from ..operators.new_material import NewDiffractionMaterial
from ..operators.osl_reference import NewOslReference
from ..operators.remove_diffraction import RemoveDiffraction
from ..operators.remove_grating import RemoveGrating
from ..operators.vary_grating import VaryGrating
from ..workflow.fitting_worlds import is_fitting, last_failure
from .facts import NOT_FITTED, Facts, GratingFacts, SceneFacts, facts_of
from .notes import draw_note
from .steps_panel import draw_scans, draw_steps

_ICONS = {"SUN": "LIGHT_SUN", "POINT": "LIGHT_POINT", "SPOT": "LIGHT_SPOT", "AREA": "LIGHT_AREA"}
_LIGHT_ICONS = {"good": "CHECKMARK", "usable": "INFO", "poor": "ERROR"}
# How each choice of lights lights the diffraction.
_LIT_BY = {
    LAMPS_ONLY: "Only lamps light the diffraction. The world and Material Preview's studio light have no effect.",
    REST: "Lamps are noise-free. The rest of the world and light from other objects are sampled at random, with noise.",
    ALL: "Every light is sampled at random. Small lamps need many samples.",
}


class PresetMenu(bpy.types.Menu):
    """Add a ready-made surface: a relief, its matter and the look of its material"""

    bl_idname = "GRATING_MT_presets"
    bl_label = "Presets"

    @guarded_draw
    def draw(self, context):
        self.layout.operator_context = "EXEC_DEFAULT"
        self.layout.operator_enum(AddPreset.bl_idname, "preset")


class SampleMenu(bpy.types.Menu):
    """Add a sample surface that ships with the extension, a preset, or a grating by its parameters"""

    bl_idname = "GRATING_MT_samples"
    bl_label = "Add Sample"

    @guarded_draw
    def draw(self, context):
        from ...precompute.surface.samples.catalogue import SAMPLES, title_of

        self.layout.operator_context = "EXEC_DEFAULT"
        for name in SAMPLES:
            entry = self.layout.operator(ImportHeightMap.bl_idname, text=title_of(name))
            entry.filepath = f"sample:{name}"
        self.layout.separator()
        self.layout.menu(PresetMenu.bl_idname)
        self.layout.operator_context = "INVOKE_DEFAULT"
        self.layout.operator(AddGrating.bl_idname, text=f"{AddGrating.bl_label}...")


class GratingList(bpy.types.UIList):
    """The scene's gratings"""

    bl_idname = "GRATING_UL_gratings"

    @guarded_item
    def draw_item(self, context, layout, data, item, icon, active_data, active_property):
        layout.prop(item, "name", text="", emboss=False, icon="TEXTURE" if item.bake_path else "IMAGE_DATA")


class GratingPanel(bpy.types.Panel):
    """Import, bake and assign gratings"""

    bl_idname = "GRATING_PT_main"
    bl_label = "Natural Gratings"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Grating"

    @guarded_draw
    def draw(self, context):
        layout = self.layout
        gratings = context.scene.natural_gratings
        row = layout.row()
        row.template_list(GratingList.bl_idname, "", gratings, "items", gratings, "active_index", rows=3)
        buttons = row.column(align=True)
        buttons.operator(ImportHeightMap.bl_idname, text="", icon="ADD")
        buttons.menu(SampleMenu.bl_idname, text="", icon="DOWNARROW_HLT")
        buttons.operator(RemoveGrating.bl_idname, text="", icon="REMOVE")
        facts = facts_of(context)
        _draw_strays(layout, context, facts.scene)
        grating = gratings.active()
        if grating is None:
            layout.label(text="Import a height map, or add a sample", icon="INFO")
            return
        _draw_bake(layout, context, grating, facts=facts.grating)
        _draw_material(layout, grating, facts.grating)
        _draw_lamps(layout, context, grating, facts=facts)


class ReferencePanel(bpy.types.Panel):
    """Reference materials for comparisons: shaders that evaluate a method of the thesis, or the bake, in every pixel"""

    bl_idname = "GRATING_PT_reference"
    bl_label = "OSL Reference"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Grating"
    bl_parent_id = GratingPanel.bl_idname
    bl_options = {"DEFAULT_CLOSED"}

    @guarded_draw
    def draw(self, context):
        from ..materials.osl.script import missing_for_osl

        self.layout.operator(NewOslReference.bl_idname, icon="SHADING_RENDERED")
        missing = missing_for_osl(context.scene)
        if missing:
            draw_note(self.layout, context, missing[0].upper() + missing[1:], icon="INFO")


def _draw_strays(layout, context, facts: SceneFacts) -> None:
    """Draw which diffraction materials are not in the list, and the button that adopts them."""
    if facts.strays:
        draw_note(layout, context, f"Not in the list: {', '.join(facts.strays)}", icon="INFO")
        layout.operator(AdoptMaterials.bl_idname, icon="IMPORT")
    for line in facts.linked:
        draw_note(layout, context, line, icon="INFO")


def _draw_bake(layout, context, grating, *, facts: GratingFacts) -> None:
    _draw_lines(layout, context, grating.summary)
    draw_scans(layout, context, facts)
    _draw_quality(layout, context, grating)
    draw_steps(layout, context, grating, several=bool(facts.scans))
    settings = layout.column(align=True)
    settings.prop(grating, "delta_e")
    settings.prop(grating, "coherence_um", text="Coherence (um)" if grating.coherence_um else "Coherence (auto)")
    row = settings.row(align=True)
    row.prop(grating, "matter")
    if grating.matter != "DIELECTRIC":
        row.prop(grating, "plate_ior", text="Plate")
    if grating.matter == LAYERS:
        settings.prop(grating, "layers", text="")
    if (job := running_bake()) is not None:
        stage, fraction = job.progress()
        layout.progress(factor=fraction, text=f"{stage} (Esc cancels)")
    else:
        layout.operator(BakeGrating.bl_idname, icon="RENDER_STILL")
        if grating.bake_path:
            row = layout.row(align=True)
            row.operator(BakeNeeds.bl_idname, icon="CAMERA_DATA")
            if grating.for_scene:
                row.operator(BakeNeeds.bl_idname, text="", icon="X").everything = True
    _draw_lines(layout, context, grating.bake_summary)
    from ..gratings.baked_region import noticed_outside

    if running_bake() is None and facts.outdated:
        draw_note(layout, context, "Settings changed since this bake; press Bake Grating", icon="ERROR")

    for line in noticed_outside(context.scene):
        draw_note(layout, context, line, icon="ERROR")


def _draw_quality(layout, context, grating) -> None:
    """Draw a scan's quality rating and its findings."""
    if not grating.quality:  # no scan: the grating was made from a bake
        return
    light, *findings = grating.quality.splitlines()
    column = layout.column(align=True)
    column.label(text=f"Quality: {light}", icon=_LIGHT_ICONS.get(light, "QUESTION"))
    for finding in findings:
        draw_note(column, context, finding)


def _draw_lines(layout, context, summary: str) -> None:
    """Draw each fact of a summary on its own line, because the sidebar is narrow."""
    column = layout.column(align=True)
    for fact in summary.splitlines():
        draw_note(column, context, fact)


def _draw_material(layout, grating, facts: GratingFacts) -> None:
    if facts.objects:
        layout.label(text=facts.objects, icon="OBJECT_DATA")
    column = layout.column(align=True)
    column.operator(NewDiffractionMaterial.bl_idname, icon="MATERIAL")
    column.operator(AssignToSelected.bl_idname, icon="BRUSH_DATA")
    row = column.row(align=True)
    row.operator(AddDiffraction.bl_idname, icon="ADD")
    row.operator(RemoveDiffraction.bl_idname, icon="REMOVE", text="Remove")
    chosen = next(label for name, label, _ in LIGHTS if name == grating.lit_by)
    row = layout.row()
    row.label(text="Lights")
    row.operator_menu_enum(ChooseLights.bl_idname, "lights", text=chosen)
    chosen = {name: label for name, label, _ in KINDS}[stored.choice(grating.frame_kind, FRAMES, STORED)]
    row = layout.row()
    row.label(text="Direction")
    row.operator(ChooseDirection.bl_idname, text=chosen, icon="ORIENTATION_LOCAL")
    _draw_comb(layout)
    row = layout.row()
    row.label(text="Variation")
    row.operator(VaryGrating.bl_idname, text=facts.variation, icon="MOD_NOISE")
    row = layout.row()
    row.label(text="Hologram")
    row.operator_menu_enum(AddHologram.bl_idname, "pattern", text=facts.hologram, icon="MESH_GRID")
    row = layout.row()
    row.prop(grating, "footprint")
    row.prop(grating, "shadows")
    layout.operator(AddDiffractionLamp.bl_idname, text="Add Diffraction Lamp", icon="LIGHT_AREA")


def _draw_comb(layout) -> None:
    if CombGrating.job is not None:
        stage, fraction = CombGrating.job.progress()
        layout.progress(factor=fraction, text=f"{stage} (Esc cancels)")
    else:
        layout.operator_menu_enum(CombGrating.bl_idname, "source", text=CombGrating.bl_label, icon="FORCE_WIND")


def _draw_lamps(layout, context, grating, *, facts: Facts) -> None:
    scene = facts.scene
    lights = grating.lit_by
    if facts.grating.no_set:
        draw_note(layout, context, facts.grating.no_set, icon="ERROR")
        lights = LAMPS_ONLY
    layout.label(text="Lit by")
    column = layout.column(align=True)
    for lamp in scene.lamps:
        row = column.row()
        row.active = not lamp.hidden
        row.label(text=f"{lamp.name} (hidden)" if lamp.hidden else lamp.name, icon=_ICONS[lamp.kind])
    if lights == REST and scene.world:
        _draw_world(column, context, scene.world)
    if not scene.lamps:
        if lights == LAMPS_ONLY:
            draw_note(column, context, "The scene has no lamp, so the diffraction is black", icon="INFO")
        column.operator(AddSun.bl_idname, icon="LIGHT_SUN")
    for line in facts.grating.crowded:
        draw_note(column, context, line, icon="ERROR")
    for line in scene.features:
        draw_note(column, context, line, icon="INFO")
    if scene.instanced:
        names = ", ".join(scene.instanced)
        draw_note(column, context, f"Instanced: {names}; Apply > Make Instances Real", icon="ERROR")
    for line in scene.wrong:
        draw_note(column, context, line, icon="ERROR")
    if scene.can_be_mended:
        column.operator(MendMaterials.bl_idname, icon="FILE_REFRESH")
    note = layout.column(align=True)
    note.active = False
    draw_note(note, context, _LIT_BY[lights])
    if not compat.HAS_RAYCAST:
        shade = "Before Blender 5.1, objects cast shadows on diffraction only in Cycles with Open Shading Language on."
        draw_note(note, context, shade)


def _draw_world(column, context, text: str) -> None:
    """Draw how the scene's world lights the diffraction."""
    if is_fitting():
        text = "fitting its sources ..."
    draw_note(column, context, f"{context.scene.world.name}: {text}", icon="WORLD")
    if text == NOT_FITTED:
        if (failure := last_failure(context.scene)) is not None:
            draw_note(column, context, in_words(failure), icon="ERROR")
        column.operator(FitWorld.bl_idname, icon="FILE_REFRESH")
