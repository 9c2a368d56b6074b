# SPDX-License-Identifier: GPL-3.0-or-later
"""The part Levelling of the panel: the list of steps, and their effect on the scan."""

import bpy

from ...precompute.base.failure import GratingError
from ..blender.guard import guarded_item
from ..gratings.wording import in_words, translated
from ..operators.level_steps import AddLevellingStep, LevellingAsText, MoveLevellingStep, RemoveLevellingStep
from .facts import GratingFacts
from .notes import draw_note

# Height of a picture in the sidebar, in rows.
_PICTURE = 5.0
# At most this many files are named; the rest is counted.
_FILES_MAX = 8


class StepList(bpy.types.UIList):
    """Steps that level and repair the scan, in order"""

    bl_idname = "GRATING_UL_steps"

    @guarded_item
    def draw_item(self, context, layout, data, item, icon, active_data, active_property):
        layout.label(text=item.text, icon="MODIFIER")


def is_levelled(grating) -> bool:
    """Whether there is nothing to level any more: a grating is baked, synthetic, or was made from a bake."""
    from ...precompute.surface.height_map import is_synthetic

    return not grating.source or bool(grating.bake_path) or is_synthetic(grating.source)


def draw_steps(layout, context, grating, *, several: bool) -> None:
    """Draw a grating's steps and the arguments of the active step, folded; with the preview if draw_surface does not
    draw it. `several`: the grating averages scans."""
    if not grating.source:  # no scan: the grating was made from a bake
        return
    header, body = layout.panel("GRATING_PT_levelling", default_closed=True)
    header.label(text=translated("Levelling: {steps}", steps=grating.levelling))
    if body is None:
        return
    buttons = body.row(align=True)
    buttons.operator_menu_enum(AddLevellingStep.bl_idname, "kind", text="Add", icon="ADD")
    buttons.operator(RemoveLevellingStep.bl_idname, text="", icon="REMOVE")
    for direction, icon in (("UP", "TRIA_UP"), ("DOWN", "TRIA_DOWN")):
        buttons.operator(MoveLevellingStep.bl_idname, text="", icon=icon).direction = direction
    buttons.operator(LevellingAsText.bl_idname, text="", icon="TEXT")
    body.template_list(StepList.bl_idname, "", grating, "steps", grating, "active_step", rows=2)
    try:
        _draw_arguments(body, grating)
    except GratingError as error:
        draw_note(body, context, in_words(error), icon="ERROR")
    if is_levelled(grating):
        draw_preview(body, context, grating, several=several)


def draw_scans(layout, context, facts: GratingFacts) -> None:
    """Draw the files of a grating that averages several scans."""
    if facts.fault is not None:
        draw_note(layout, context, in_words(facts.fault), icon="ERROR")
    column = layout.column(align=True)
    for name in facts.scans[:_FILES_MAX]:
        column.label(text=name, icon="FILE", translate=False)
    if len(facts.scans) > _FILES_MAX:
        column.label(text=translated("and {count} more", count=len(facts.scans) - _FILES_MAX), icon="BLANK1")


def _draw_arguments(layout, grating) -> None:
    column = layout.column(align=True)
    if 0 <= grating.active_step < len(grating.steps):
        step = grating.steps[grating.active_step]
        for name in step.shown():
            column.prop(step, name)


def draw_preview(layout, context, grating, *, several: bool) -> None:
    """Draw pictures of a grating's scan before and after its steps, with their range, rms and main period. `several`:
    the grating averages scans."""
    from ...precompute.surface.steps.pipeline import WARNING
    from ..workflow.levelling import shown

    try:
        found = shown(grating)
    except GratingError as error:
        draw_note(layout, context, in_words(error), icon="ERROR")
        return
    if found is None:
        layout.label(text="Levelling the scan ...", icon="SORTTIME")
        return
    if found.preview is None:
        draw_note(layout, context, in_words(found.failure or ""), icon="ERROR")
        return
    columns = layout.row(align=True)
    looks = (found.preview.before, found.preview.after)
    for title, icon, look in zip(("As scanned", "Levelled"), found.icons, looks, strict=True):
        column = columns.column(align=True)
        column.label(text=title)
        column.template_icon(icon_value=icon, scale=_PICTURE)
        for line in look.in_words():
            column.label(text=line)
    notes = layout.column(align=True)
    if several:
        draw_note(notes, context, "Preview of the first scan")
    for line in found.preview.told:
        warned = line.startswith(WARNING)
        draw_note(notes, context, line.removeprefix(WARNING), icon="ERROR" if warned else "INFO")
    if found.every > 1:
        text = "The preview shows 1 pixel in {every} along x and y. The bake uses all pixels"
        draw_note(notes, context, translated(text, every=found.every))
