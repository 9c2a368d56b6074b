# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands that the project's pages print."""

import re
import shlex
from pathlib import Path

from devtools import ROOT

PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")])
_PROGRAMS = r"(?:\./dev|blender|python)"
_PLACEHOLDERS = {"VERB", "NAME", "PATH"}
_BLOCK = re.compile(rf"^ {{4,}}({_PROGRAMS} .*)$", re.MULTILINE)
_IN_TEXT = re.compile(rf"`({_PROGRAMS}\s[^`]*)`")
# What follows a command on its line: an explanation after three spaces or a mark, or the file that takes its output.
_FOLLOWING = re.compile(r"   .*| [#>] .*")


def on_lines(page: Path) -> list[list[str]]:
    """The commands that a page prints on lines of their own, in their order, each as its words."""
    return [shlex.split(_FOLLOWING.sub("", line)) for line in _BLOCK.findall(page.read_text(encoding="utf-8"))]


def printed(page: Path) -> list[list[str]]:
    """All commands of a page, also those in its sentences, but not patterns of commands. The changelog's are those of
    their time."""
    if page.name == "CHANGELOG.md":
        return []
    in_text = (shlex.split(text) for text in _IN_TEXT.findall(page.read_text(encoding="utf-8")))
    return [words for words in (*on_lines(page), *in_text) if not _PLACEHOLDERS & set(words)]
