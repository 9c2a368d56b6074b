# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's step Quality: how exact the bake is, its memory, and the material's switches."""

from ..gratings.grating import DAYLIGHT, QUALITIES, quality_of
from ..gratings.wording import translated
from ..materials.skin import cost_of, heavy
from ..operators.bake import BakeGrating, BakeNeeds, ChooseQuality
from ..operators.shared import running_bake
from .folds import DETAILS, folds
from .notes import draw_facts, draw_note, side_by_side


def draw_quality(layout, context, grating) -> None:
    """Draw how exact a grating's bake is, and what it costs."""
    row = layout.row(align=True)
    chosen = quality_of(grating)
    for each in QUALITIES:
        row.operator(
            ChooseQuality.bl_idname, text=translated(each.label), depress=each.name == chosen
        ).quality = each.name
    if running_bake() is None:
        row = side_by_side(layout, context, BakeGrating.bl_label, "For Camera")
        row.operator(BakeGrating.bl_idname, icon="RENDER_STILL")
        if grating.bake_path:
            row = row.row(align=True)
            row.operator(BakeNeeds.bl_idname, text="For Camera", icon="CAMERA_DATA")
            if grating.for_scene:
                row.operator(BakeNeeds.bl_idname, text="", icon="X").everything = True
    row = side_by_side(layout, context, "Footprint", "Shadows", "Every Lamp")
    row.prop(grating, "footprint")
    row.prop(grating, "shadows")
    row.prop(grating, "every_lamp")
    group = grating.group
    for line in heavy(group) if group else ():
        draw_note(layout, context, line, icon="INFO")
    header, body = layout.panel_prop(folds(context), DETAILS)
    header.label(text="Details")
    if body is not None:
        settings = body.column(align=True)
        settings.prop(grating, "delta_e")
        settings.prop(grating, "coherence_um", text="Coherence (um)" if grating.coherence_um else "Coherence (auto)")
        settings.prop(grating, "spread_deg")
        settings.prop(grating, "illuminant", placeholder=DAYLIGHT)
        summary = [grating.bake_summary, cost_of(group) if group else ""]
        draw_facts(body, context, "\n".join(filter(None, summary)))
