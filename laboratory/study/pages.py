# SPDX-License-Identifier: GPL-3.0-or-later
"""Fills the pages of docs/ with figures. A page is its own template: its sentences stand in docs/ alone, and a program
replaces only what lies between the two marks of a place."""

import re
from collections.abc import Mapping, Sequence

from devtools import ROOT

# A place for figures: in a line `<!-- NAME -->figure<!-- /NAME -->`, or with the figures in lines of their own.
_PLACE = re.compile(r"<!-- (?P<name>[^/>][^>]*) -->.*?<!-- /(?P=name) -->", re.DOTALL)


def filled(page: str, figures: Mapping[str, str], *, part: str = "") -> str:
    """The text of a page of docs/ with new figures in the places that they are named after. If several programs fill
    the page, `part` is the beginning of the names of one program's places; the others stay.

    Raises ValueError if the page does not have exactly these places."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    places = [place["name"] for place in _PLACE.finditer(text) if place["name"].startswith(part)]
    if sorted(places) != sorted(figures):
        raise ValueError(f"{page}: its places are {places}, the figures {list(figures)}")

    def new(place: re.Match) -> str:
        name, old = place["name"], place[0]
        if not name.startswith(part):
            return old
        around = "\n" if "-->\n" in old else ""
        return f"<!-- {name} -->{around}{figures[name].strip()}{around}<!-- /{name} -->"

    return _PLACE.sub(new, text)


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (header, ["---"] * len(header), *rows))
