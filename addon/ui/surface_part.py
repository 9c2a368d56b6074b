# SPDX-License-Identifier: GPL-3.0-or-later
"""The panel's step Surface: the scan, its rating and its levelling."""

import re

from ...precompute.base.failure import Setting
from ..gratings.wording import LABELS, translated
from ..operators.level_steps import AddLevellingStep
from ..operators.show_picture import KINDS, ShowPicture
from .facts import GratingFacts
from .folds import FINDINGS, folds
from .notes import draw_facts, draw_note, side_by_side
from .steps_panel import draw_preview, draw_scans, draw_steps, is_levelled

# The beginnings of the lines of a summary that the pictures' captions repeat.
_IN_PREVIEW = ("relief ", "period ")
_LIGHT_ICONS = {"good": "CHECKMARK", "usable": "INFO", "poor": "ERROR"}


def draw_surface(layout, context, grating, *, facts: GratingFacts) -> None:
    """Draw the facts of a grating's scan, and how it is levelled. While a scan waits for its bake, pictures show it
    before and after levelling, with their relief and period."""
    levelled, several = is_levelled(grating), bool(facts.scans)
    summary = grating.summary or "Made from a bake, without a scan"
    if not levelled:
        summary = "\n".join(line for line in summary.splitlines() if not line.startswith(_IN_PREVIEW)) or summary
    draw_facts(layout, context, summary)
    draw_scans(layout, context, facts)
    if not levelled:
        draw_preview(layout, context, grating, several=several)
    draw_pictures(layout, context, grating)
    draw_rating(layout, context, grating)
    draw_steps(layout, context, grating, several=several)


def draw_pictures(layout, context, grating) -> None:
    """Draw the buttons that show a grating as a picture: of its scan if it has one, of its colours once it is baked."""
    names = [*(["HEIGHT", "SPECTRUM"] if grating.source else []), *(["CHART"] if grating.bake_path else [])]
    kinds = {name: label for name, label, _ in KINDS if name in names}
    row = side_by_side(layout, context, *kinds.values(), icon=12)
    for name, label in kinds.items():
        row.operator(ShowPicture.bl_idname, text=translated(label)).kind = name


def draw_rating(layout, context, grating) -> None:
    """Draw a scan's quality rating and its findings."""
    if not grating.quality:  # no scan: the grating was made from a bake
        return
    light, *findings = grating.quality.splitlines()
    header, body = layout.panel_prop(folds(context), FINDINGS) if findings else (layout.row(), None)
    header.label(text=translated("Scan: {rating}", rating=translated(light)), icon=_LIGHT_ICONS.get(light, "QUESTION"))
    if body is not None:
        column = body.column(align=True)
        for finding in findings:
            draw_note(column, context, finding)
    # The buttons stay on the screen where the findings are folded.
    present = {step.text.partition(":")[0] for step in grating.steps}
    for kind in (kind for finding in findings for kind in _steps_in(finding)):
        if kind not in present:
            text = translated("Add {kind} Step", kind=kind.capitalize())
            button = layout.operator(AddLevellingStep.bl_idname, text=text, icon="ADD")
            button.kind = kind


def _steps_in(finding: str) -> list[str]:
    """The kinds of steps that a finding advises: dust in "...; bake it with Levelling plane,dust"."""
    found = re.search(rf"{LABELS[Setting.LEVEL]} ([\w,:]+)", finding)
    return [text.partition(":")[0] for text in found[1].split(",")] if found else []
