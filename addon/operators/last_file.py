# SPDX-License-Identifier: GPL-3.0-or-later
"""Where the file dialogs of this session start: at the file that was refused with all that was typed, or in the folder
of the last one."""

import os
from pathlib import Path
from typing import Any

import bpy

# The values of each operator's dialog, by the operator's class.
_left: dict[str, dict[str, Any]] = {}


def start_where_left(operator: bpy.types.Operator) -> None:
    """Set the values of an operator's file dialog. The first one starts in the .blend's folder; without this, it would
    offer the .blend itself."""
    for name, value in _left.get(type(operator).__name__, {"filepath": bpy.path.abspath("//")}).items():
        setattr(operator, name, value)


def leave(operator: Any, done: set[str], **typed: Any) -> set[str]:
    """Keep the folder of an operator's dialog; if the file was refused, the file and what was typed. Returns `done`,
    what the operator's execute() returns."""
    refused = {"filepath": operator.filepath, **typed}
    folder = {"filepath": str(Path(operator.filepath).parent) + os.sep}
    _left[type(operator).__name__] = folder if done == {"FINISHED"} else refused
    return done
