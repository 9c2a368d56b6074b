# SPDX-License-Identifier: GPL-3.0-or-later
"""A failure as a line of JSON: so a process tells it to the one that started it, which gets its fields again.

The line is {"error": {"what": WHAT, "fault": FAULT, "remedy": [TEXT, {"setting": OPTION}, ...]}}."""

import contextlib
import json
from collections.abc import Sequence

from .failure import GratingError, Setting
from .strict_json import parse_json


def failure_line(error: GratingError) -> str:
    """A failure as a line of JSON."""
    remedy = [error.remedy] if isinstance(error.remedy, str) else error.remedy
    parts = [{"setting": part.value} if isinstance(part, Setting) else part for part in remedy]
    return json.dumps({"error": {"what": str(error.what), "fault": error.fault, "remedy": parts}})


def failure_in(lines: Sequence[str]) -> GratingError | None:
    """The failure that the last such line tells; None if no line does. A killed process may leave half a line."""
    for line in reversed(lines):
        if line.startswith("{"):
            with contextlib.suppress(GratingError):
                match parse_json(line, "", ""):
                    case {"error": {"what": str(what), "fault": str(fault), "remedy": list(parts)}}:
                        return GratingError(what, fault, [_part(part) for part in parts])
    return None


def _part(part: object) -> str | Setting:
    """A part of a remedy. A setting that only a newer version has stays an option of the command line."""
    match part:
        case {"setting": str(name)}:
            return Setting(name) if name in {setting.value for setting in Setting} else name
    return part if isinstance(part, str) else ""
