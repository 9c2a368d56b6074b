# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's step Quality: how exact the bake is, its memory, and the material's switches."""

from ..gratings.bake_quality import QUALITIES, quality_of
from ..gratings.matter_fields import DAYLIGHT
from ..gratings.wording import translated
from ..operators.bake_grating import BakeGrating
from ..operators.bake_needs import BakeNeeds
from ..operators.choose_quality import ChooseQuality
from ..operators.follows_bake import running_bake
from .folds import DETAILS, folds
from .notes import draw_facts, side_by_side


def draw_quality(layout, context, grating) -> None:
    """Draw how exact a grating's bake is, and what it costs."""
    row = layout.row(align=True)
    chosen = quality_of(grating)
    for each in QUALITIES:
        row.operator(
            ChooseQuality.bl_idname, text=translated(each.label), depress=each.name == chosen
        ).quality = each.name
    if running_bake() is None:
        row = layout.row(align=True)
        row.operator(BakeGrating.bl_idname, icon="RENDER_STILL")
        if grating.bake_path:
            row.operator(BakeNeeds.bl_idname, text="For Camera", icon="CAMERA_DATA")
            if grating.for_scene:
                row.operator(BakeNeeds.bl_idname, text="", icon="X").everything = True
    row = side_by_side(layout)
    row.prop(grating, "footprint")
    row.prop(grating, "shadows")
    row.prop(grating, "every_lamp")
    header, body = layout.panel_prop(folds(context), DETAILS)
    header.label(text="Details")
    if body is not None:
        settings = body.column(align=True)
        settings.prop(grating, "delta_e")
        settings.prop(grating, "coherence_um", text="Coherence (um)" if grating.coherence_um else "Coherence (auto)")
        settings.prop(grating, "spread_deg")
        settings.prop(grating, "illuminant", placeholder=DAYLIGHT)
        draw_facts(body, context, grating.bake_summary)
