# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel Grating: what to do next as one large button, and the steps of the work below it. It is in the sidebars of
the 3D view and of the shader editor, and in the material's properties."""

from typing import TYPE_CHECKING

import bpy

from ..blender.guard import guarded_draw, guarded_item
from ..gratings.grating import QUALITIES, quality_of
from ..gratings.wording import counted, marked, translated
from ..operators.add_grating import AddGrating, RemoveGrating
from ..operators.add_preset import AddPreset, BackFromShow, LoadPreset, ShowMe
from ..operators.assign import AdoptMaterials
from ..operators.import_files import ImportHeightMap, LoadBake
from ..operators.light import AddLightRig
from ..operators.make_assets import MakeAssets, RemoveAssets
from ..operators.osl_reference import NewOslReference
from ..operators.shared import draw_progress, running_bake, selected_meshes
from ..operators.why_black import WhyBlack
from .facts import DONE, LIGHT, LOOK, QUALITY, SURFACE, Next, SceneFacts, facts_of, next_step, state_of
from .folds import PRESETS, fold_of, folds
from .installation import draw_manual, draw_missing
from .light_part import draw_light, draw_warnings
from .look_part import draw_look, draw_stickers
from .notes import draw_note
from .preset_pictures import CHOSEN, presets_with_pictures
from .quality_part import draw_quality
from .surface_part import draw_surface

# Heights of the presets' pictures, in the panel and in the list that it opens, and of the large buttons, in rows.
_PICTURE, _PICTURE_IN_LIST, _LARGE = 6.0, 6.8, 1.5
# The custom property of Show Me's scenes (showcase/show_views.py, which loads only when needed).
_SHOW = "ng_show"


class PresetMenu(bpy.types.Menu):
    """Add a ready-made surface: a relief, its matter and the look of its material"""

    bl_idname = "GRATING_MT_presets"
    bl_label = "Presets"

    @guarded_draw
    def draw(self, context):
        self.layout.operator_context = "EXEC_DEFAULT"
        for name, title, _, picture, _ in presets_with_pictures(None, context):
            self.layout.operator(AddPreset.bl_idname, text=title, icon_value=picture).preset = name


class SampleMenu(bpy.types.Menu):
    """Add a preset, a scan, a grating by its parameters, a bake, or a sample surface that ships with the extension"""

    bl_idname = "GRATING_MT_samples"
    bl_label = "Add Surface"

    @guarded_draw
    def draw(self, context):
        from ...precompute.surface.samples.catalogue import SAMPLES, title_of

        self.layout.menu(PresetMenu.bl_idname, icon="PRESET")
        self.layout.operator_menu_enum(ShowMe.bl_idname, "preset", icon="HIDE_OFF")
        self.layout.operator_context = "INVOKE_DEFAULT"
        self.layout.operator(ImportHeightMap.bl_idname, text="Import Scan...", icon="IMPORT")
        self.layout.operator(AddGrating.bl_idname, text="Grating by Parameters...", icon="MOD_WAVE")
        self.layout.operator(LoadBake.bl_idname, text="Load Bake...", icon="FILE_FOLDER")
        self.layout.operator(LoadPreset.bl_idname, text="Load Preset...", icon="PRESET")
        self.layout.separator()
        self.layout.label(text="Samples")
        self.layout.operator_context = "EXEC_DEFAULT"
        for name in sorted(SAMPLES, key=lambda name: (name == "flat", title_of(name))):  # what shows no colours is last
            entry = self.layout.operator(ImportHeightMap.bl_idname, text=title_of(name))
            entry.filepath = f"sample:{name}"


class GratingList(bpy.types.UIList):
    """The scene's gratings"""

    bl_idname = "GRATING_UL_gratings"

    @guarded_item
    def draw_item(self, context, layout, data, item, icon, active_data, active_property):
        layout.prop(item, "name", text="", emboss=False, icon="TEXTURE" if item.bake_path else "IMAGE_DATA")


# Only the type checker sees the mixin as a panel, because Blender registers the classes that inherit it.
if TYPE_CHECKING:
    _Panel = bpy.types.Panel
else:
    _Panel = object


class _Drawn(_Panel):
    """What the panels have in common."""

    bl_label = "Natural Gratings"

    @guarded_draw
    def draw(self, context):
        _draw_work(self.layout, context)
        draw_missing(self.layout, context)

    @guarded_draw
    def draw_header_preset(self, context):
        draw_manual(self.layout, text="", emboss=False)


class GratingPanel(_Drawn, bpy.types.Panel):
    """Import, bake and assign gratings"""

    bl_idname = "GRATING_PT_main"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Grating"


class MaterialPanel(_Drawn, bpy.types.Panel):
    """Import, bake and assign gratings"""

    bl_idname = "GRATING_PT_material"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"
    bl_options = {"DEFAULT_CLOSED"}


class ShaderPanel(_Drawn, bpy.types.Panel):
    """Import, bake and assign gratings"""

    bl_idname = "GRATING_PT_shader"
    bl_space_type = "NODE_EDITOR"
    bl_region_type = "UI"
    bl_category = "Grating"

    @classmethod
    def poll(cls, context):
        return context.space_data.tree_type == "ShaderNodeTree"


class ReferencePanel(bpy.types.Panel):
    """Reference materials for comparisons: shaders that evaluate a method of the thesis, or the bake, in every pixel"""

    bl_idname = "GRATING_PT_reference"
    bl_label = "OSL Reference"
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
        from ..materials.osl.script import missing_for_osl

        self.layout.operator(NewOslReference.bl_idname, icon="SHADING_RENDERED")
        missing = missing_for_osl(context.scene)
        if missing:
            text = translated(missing)
            draw_note(self.layout, context, text[0].upper() + text[1:], icon="INFO")


def _draw_work(layout, context) -> None:
    """Draw the steps of the work, or what an artist can begin with."""
    from ..gratings.bakes import noticed_outside

    gratings = context.scene.natural_gratings
    if context.scene.get(_SHOW):
        layout.operator(BackFromShow.bl_idname, icon="LOOP_BACK")
    facts = facts_of(context)
    _draw_strays(layout, context, facts.scene)
    grating = gratings.active()
    if grating is None:
        if facts.scene.strays or facts.scene.linked:
            draw_warnings(layout, context, facts)
        _draw_start(layout, context)
        return
    row = layout.row()
    row.template_list(GratingList.bl_idname, "", gratings, "items", gratings, "active_index", rows=2)
    buttons = row.column(align=True)
    buttons.menu(SampleMenu.bl_idname, text="", icon="ADD")
    buttons.operator(RemoveGrating.bl_idname, text="", icon="REMOVE")
    header, body = layout.panel_prop(folds(context), PRESETS)
    header.label(text="Presets")
    if body is not None:
        _draw_presets(body, context)
        draw_assets(body)
    following = next_step(context, grating, facts)
    _draw_next(layout, context, following)
    draw_warnings(layout, context, facts)
    for line in noticed_outside(context.scene):
        draw_note(layout, context, line, icon="ERROR")
    quality = next((each.label for each in QUALITIES if each.name == quality_of(grating)), marked("Custom"))
    lamps = sum(not lamp.hidden for lamp in facts.scene.lamps)
    parts = (
        (SURFACE, _period(grating), lambda body: draw_surface(body, context, grating, facts=facts.grating)),
        (
            LOOK,
            counted("{count} object", "{count} objects", facts.grating.shown_on),
            lambda body: draw_look(body, context, grating, facts=facts.grating),
        ),
        (
            LIGHT,
            counted("{count} lamp", "{count} lamps", lamps),
            lambda body: draw_light(body, context, grating, facts=facts),
        ),
        (QUALITY, quality, lambda body: draw_quality(body, context, grating)),
    )
    for step, text, draw in parts:
        state = state_of(step, following)
        header, body = layout.panel_prop(folds(context), fold_of(step, state))
        title = translated(step)
        header.label(
            text=f"{title}: {translated(text)}" if text else title, icon="CHECKMARK" if state == DONE else "NONE"
        )
        if body is not None:
            draw(body)


def _draw_start(layout, context) -> None:
    """Draw what an artist can begin with: a preset by its picture, an own scan, or a sample."""
    chosen_preset = _draw_presets(layout, context)
    for button in draw_stickers(layout, context):
        # Until one is chosen, a sticker is a hologram, as the first picture is a snake's.
        if context.window_manager.is_property_set(CHOSEN):
            button.preset = chosen_preset
    row = layout.row(align=True)
    row.operator(ImportHeightMap.bl_idname, text="Import Scan...", icon="IMPORT")
    row.menu(SampleMenu.bl_idname, text="", icon="DOWNARROW_HLT")
    draw_assets(layout)


def _draw_presets(layout, context) -> str:
    """Draw the grid of the presets' pictures, and what can be done with the chosen one, whose name is returned."""
    manager = context.window_manager
    chosen_preset: str = getattr(manager, CHOSEN)
    layout.template_icon_view(manager, CHOSEN, show_labels=True, scale=_PICTURE, scale_popup=_PICTURE_IN_LIST)
    title = next((title for name, title, *_ in presets_with_pictures(manager, context) if name == chosen_preset), "")
    layout.label(text=translated(title))
    column = layout.column(align=True)
    column.scale_y = _LARGE
    column.operator(ShowMe.bl_idname, icon="HIDE_OFF").preset = chosen_preset
    chosen = selected_meshes(context)
    text = translated("Add to This Scene")
    if chosen:
        text = counted("Put on {name}", "Put on {count} Meshes", len(chosen), name=chosen[0].name)
    button = column.operator(AddPreset.bl_idname, text=text, icon="BRUSH_DATA")
    button.preset = chosen_preset
    return chosen_preset


def _draw_strays(layout, context, facts: SceneFacts) -> None:
    """Draw which diffraction materials are not in the list, and the button that adopts them."""
    if facts.strays:
        draw_note(layout, context, translated("Not in the list: {names}", names=", ".join(facts.strays)), icon="INFO")
        layout.operator(AdoptMaterials.bl_idname, icon="IMPORT")
    for line in facts.linked:
        draw_note(layout, context, line, icon="INFO")


def _draw_next(layout, context, following: Next | None) -> None:
    """Draw what to do next, or the bake that is running."""
    if (bake := running_bake()) is not None:
        draw_progress(layout, bake)
        return
    if following is not None:
        _draw_button(layout, context, following)
    if following is None or following.step in (LIGHT, QUALITY):
        row = layout.row(align=True)
        if following is None or following.operator != AddLightRig.bl_idname:
            row.operator(AddLightRig.bl_idname, icon="OUTLINER_OB_LIGHT")
        row.operator_menu_enum(AddLightRig.bl_idname, "kind", text="", icon="DOWNARROW_HLT")
        layout.operator(WhyBlack.bl_idname, icon="QUESTION")


def _draw_button(layout, context, following: Next) -> None:
    if following.sentence:
        draw_note(layout, context, following.sentence, icon="INFO")
    if following.operator:
        row = layout.row()
        row.scale_y = _LARGE
        # Bakes work in the background only if they are invoked. Other operators would ask for what is given here. The
        # setting counts for all of the panel, also for the buttons below.
        invoked = row.operator_context
        row.operator_context = "EXEC_DEFAULT" if following.properties else invoked
        button = row.operator(following.operator, text=translated(following.text), icon=following.icon)
        for name, value in following.properties.items():
            setattr(button, name, value)
        row.operator_context = invoked


def _period(grating) -> str:
    """A grating's period and its lines per millimetre, from its summary; empty if it is not known."""
    for line in grating.summary.splitlines():
        if line.startswith("period "):
            period_nm = float(line.split()[1])
            numbers = {"period": f"{period_nm:.0f}", "lines": f"{1e6 / period_nm:.0f}"}
            return translated("{period} nm, {lines} lines/mm", **numbers)
    return ""


def draw_assets(layout) -> None:
    """Draw the button that writes the presets' asset library, or how far it is, and the button that removes it."""
    if MakeAssets.job is not None:
        draw_progress(layout, MakeAssets)
        return
    from ..assets.library import is_listed

    row = layout.row(align=True)
    if is_listed():
        row.operator(MakeAssets.bl_idname, text="Update in Asset Browser", icon="ASSET_MANAGER")
        row.operator(RemoveAssets.bl_idname, text="", icon="TRASH")
    else:
        row.operator(MakeAssets.bl_idname, icon="ASSET_MANAGER")
