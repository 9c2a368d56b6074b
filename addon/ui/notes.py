# SPDX-License-Identifier: GPL-3.0-or-later
"""Wrapped text and rows for the narrow sidebar."""

import textwrap

from ..gratings.wording import translated

# Mean width of a letter, and width of icon and margins, in pixels at an interface scale of 1.
_LETTER, _MARGINS = 6.5, 55


def draw_note(layout, context, text: str, *, icon: str = "NONE") -> None:
    """Draw a sentence in the interface's language, wrapped to the sidebar's width."""
    width = context.region.width / context.preferences.system.ui_scale - _MARGINS
    for line in textwrap.wrap(translated(text), max(16, int(width / _LETTER))):
        layout.label(text=line, icon=icon, translate=False)
        icon = "BLANK1" if icon != "NONE" else icon


def side_by_side(layout):
    """A row whose buttons go on below each other where the sidebar is too narrow for their texts."""
    return layout.grid_flow(row_major=True, even_columns=True, align=True)


def draw_facts(layout, context, facts: str) -> None:
    """Draw a summary, each of its lines on a line of its own."""
    column = layout.column(align=True)
    for fact in facts.splitlines():
        draw_note(column, context, fact)
