# SPDX-License-Identifier: GPL-3.0-or-later
"""Fills the pages of docs/ with figures. A page is its own template: its sentences stand in docs/ alone, and a program
replaces only what lies between the two marks of a place."""

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from devtools import ROOT
from devtools.docs.pages import FIGURES, PLACE
from precompute.bake.cache import BAKE_VERSION
from precompute.base.files import write_whole


def filled(page: str, figures: Mapping[str, str], *, part: str = "") -> str:
    """The text of a page of docs/ with new figures in the places that they are named after. If several programs fill
    the page, `part` is the beginning of the names of one program's places; the others stay.

    Raises ValueError if the page does not have exactly these places."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    places = [place["name"] for place in PLACE.finditer(text) if place["name"].startswith(part)]
    if sorted(places) != sorted(figures):
        raise ValueError(f"{page}: its places are {places}, the figures {list(figures)}")

    def new(place: re.Match) -> str:
        name, old = place["name"], place[0]
        if not name.startswith(part):
            return old
        around = "\n" if "-->\n" in old else ""
        return f"<!-- {name} -->{around}{figures[name].strip()}{around}<!-- /{name} -->"

    return PLACE.sub(new, text)


def write_page(folder: Path, page: str, text: str, *, part: str = "") -> None:
    """Write the text of a filled page into a folder, and the record of its figures beside it. `./dev docs` compares a
    page with this record, and asks for new figures once bakes have changed. `part`: as in `filled`."""
    known = ROOT / "docs" / FIGURES
    record = json.loads(known.read_text(encoding="utf-8")) if known.exists() else {}
    of_page = record.setdefault(page, {})
    for place in PLACE.finditer(text):
        if place["name"].startswith(part):
            of_page[place["name"]] = {"bake_version": BAKE_VERSION, "figure": place["figure"].strip()}
    record_text = json.dumps(record, indent=1, sort_keys=True, ensure_ascii=False) + "\n"
    for name, content in ((page, text), (FIGURES, record_text)):
        write_whole(folder / name, lambda path, content=content: path.write_text(content, encoding="utf-8"))


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (header, ["---"] * len(header), *rows))
