# SPDX-License-Identifier: GPL-3.0-or-later
"""Wrapped text and rows for the narrow sidebar."""

import textwrap

from ..gratings.wording import translated

# Mean width of a letter, and widths of a note's icon and margins and of the panel's edges, in pixels at an interface
# scale of 1.
_LETTER, _MARGINS, _EDGES = 6.5, 55, 48


def draw_note(layout, context, text: str, *, icon: str = "NONE") -> None:
    """Draw a sentence in the interface's language, wrapped to the sidebar's width."""
    width = context.region.width / context.preferences.system.ui_scale - _MARGINS
    column = layout.column(align=True)
    for line in textwrap.wrap(translated(text), max(16, int(width / _LETTER))):
        column.label(text=line, icon=icon, translate=False)
        icon = "BLANK1" if icon != "NONE" else icon


def side_by_side(layout, context, *texts: str, icon: float = 32):
    """A row for buttons with these texts, or a column where the sidebar is too narrow for them. `icon`: the width of a
    button's icon and margins, in pixels."""
    widest = max(map(len, map(translated, texts)), default=0) * _LETTER + icon
    room = context.region.width / context.preferences.system.ui_scale - _EDGES
    return layout.row(align=True) if len(texts) * widest <= room else layout.column(align=True)


def draw_facts(layout, context, facts: str) -> None:
    """Draw a summary, each of its lines on a line of its own."""
    column = layout.column(align=True)
    for fact in facts.splitlines():
        draw_note(column, context, fact)
