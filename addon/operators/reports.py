# SPDX-License-Identifier: GPL-3.0-or-later
"""Reporting to an artist, in the words of Blender's interface."""

import re

import bpy

from ...precompute.base.failure import GratingError, printable
from ..gratings.cache_folder import cache_folder

# Precompute names its settings as its command line does. Here each is named as the panel and the dialogs name it.
WORDS = {
    "--size-um": "Width (um) in the import dialog",
    "--height-nm": "Height (nm) in the import dialog",
    "--channel": "Channel in the import dialog",
    "--delta-e": "Colour Error",
    "--coherence-um": "Coherence",
    "--level": "Levelling",
    "--method": "Method",
    "--terms": "terms, as the command line may be asked for",
    "--needs": "a needs file, which the command line takes",
    "--model": "the model of coherence, which the command line takes:",
    "--period-nm": "a period, which the command line takes",
    # Of Gwyddion's command line, which is the same for everyone.
    "--convert-to-gwy": "--convert-to-gwy",
}
# An option, and after it the capital letter that stands for its value.
_OPTION = re.compile(r"(--[a-z][a-z-]*)(?: [A-Z]\b)?")


def report_failure(operator: bpy.types.Operator, error: GratingError) -> set[str]:
    """Report an error to the artist. Returns what the operator's execute() returns then."""
    operator.report({"ERROR"}, in_words(str(error)))
    return {"CANCELLED"}


def report_lines(operator: bpy.types.Operator, lines: list[str]) -> set[str]:
    """Report what was done, the first line, and warnings, the others. Returns what execute() returns then."""
    for line in lines[:1]:
        operator.report({"INFO"}, in_words(printable(line)))
    for line in lines[1:]:
        operator.report({"WARNING"}, in_words(printable(line)))
    return {"FINISHED"}


def in_words(message: str) -> str:
    """A message of precompute in an artist's words: options of the command line have the names of the panel, and a file
    in the cache has its name for its path, which takes more than 100 letters."""
    in_cache = re.escape(str(cache_folder())) + r"[/\\](?:[^/\\:;]+[/\\])*([^/\\:;]+)"
    message = re.sub(in_cache, r"\1 in the cache", message)
    return _OPTION.sub(lambda found: WORDS.get(found[1], found[0]), message)
