# SPDX-License-Identifier: GPL-3.0-or-later
"""Output of the benchmarks: printed lines, JSON with `--json FILE|-`, and pages of docs/."""

import argparse
import re
import sys
from collections.abc import Mapping

from devtools import ROOT
from precompute.cli.printing import emit

# A place for figures: in a line `<!-- NAME -->figure<!-- /NAME -->`, or with the figures in lines of their own.
_PLACE = re.compile(r"<!-- (?P<name>[^/>][^>]*) -->.*?<!-- /(?P=name) -->", re.DOTALL)


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add the option whose value `say` and `write` take."""
    parser.add_argument("--json", metavar="FILE|-", help="write the figures as JSON")


def say(line: str, target: str | None) -> None:
    """Print a line; on standard error if the JSON goes to standard output."""
    print(line, file=sys.stderr if target == "-" else sys.stdout, flush=True)


def write(facts: dict, target: str | None) -> None:
    """Write the facts as JSON if requested."""
    if target:
        emit(facts, target, lambda: [target])


def filled(page: str, figures: Mapping[str, str]) -> str:
    """The text of a page of docs/ with new figures in the places named after them.

    Raises ValueError if the page's places differ from the figures' names."""
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    places = [place["name"] for place in _PLACE.finditer(text)]
    if sorted(places) != sorted(figures):
        raise ValueError(f"{page}: its places are {places}, the figures {list(figures)}")

    def new(place: re.Match) -> str:
        name, old = place["name"], place[0]
        around = "\n" if "-->\n" in old else ""
        return f"<!-- {name} -->{around}{figures[name].strip()}{around}<!-- /{name} -->"

    return _PLACE.sub(new, text)
