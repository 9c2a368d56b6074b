# SPDX-License-Identifier: GPL-3.0-or-later
"""The file that a command line names. If Blender cannot open it, a command runs all the same, on the startup scene."""

import os.path
import re
from collections.abc import Sequence
from itertools import takewhile

import bpy

from ...precompute.base.failure import GratingError

_BLEND = re.compile(r"\.blend\d*", re.IGNORECASE)


def check_opened(line: Sequence[str]) -> None:
    """Raise GratingError if Blender's command line names a file that is not the open one. A script on the line may have
    opened or saved another."""
    own = list(takewhile(lambda word: word not in ("-c", "--command", "--"), line))
    named = [word for word in own if _BLEND.fullmatch(os.path.splitext(word)[1])]
    if not named:
        return
    asked, opened = named[-1], bpy.data.filepath
    if not os.path.exists(asked):
        raise GratingError(asked, "there is no such file", "correct its path")
    with_script = any(word.startswith(("-P", "--python")) for word in own)
    if not opened or not (with_script or os.path.samefile(asked, opened)):
        raise GratingError(asked, "Blender did not open it", "open it in a window of Blender to see why")
