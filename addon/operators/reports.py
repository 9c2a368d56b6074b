# SPDX-License-Identifier: GPL-3.0-or-later
"""Reporting to an artist, in the words of Blender's interface."""

from collections.abc import Callable, Sequence

import bpy

from ...precompute.base.failure import GratingError, printable
from ..gratings.wording import in_words


def report_failure(operator: bpy.types.Operator, error: GratingError) -> set[str]:
    """Report an error to the artist. Returns what the operator's execute() returns then."""
    operator.report({"ERROR"}, in_words(error))
    return {"CANCELLED"}


def report_added(operator: bpy.types.Operator, add: Callable[[], Sequence[str]]) -> set[str]:
    """Add gratings by `add`, and report its line for each, or its GratingError. Returns what execute() returns then."""
    try:
        lines = add()
    except GratingError as error:
        return report_failure(operator, error)
    for line in lines:
        operator.report({"INFO"}, printable(line))
    return {"FINISHED"}


def report_lines(operator: bpy.types.Operator, lines: Sequence[GratingError | str]) -> set[str]:
    """Report what was done, the first line, and warnings, the others. Returns what execute() returns then."""
    for line in lines[:1]:
        operator.report({"INFO"}, in_words(line))
    for line in lines[1:]:
        operator.report({"WARNING"}, in_words(line))
    return {"FINISHED"}
