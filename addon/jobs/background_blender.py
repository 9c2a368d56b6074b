# SPDX-License-Identifier: GPL-3.0-or-later
"""The command that starts a second Blender, which leaves the artist's file and windows alone."""

import sys
from pathlib import Path

import bpy

from ...precompute.base.child_process import PYTHON_FLAGS


def background_blender(script: Path, *arguments: str) -> list[str]:
    """The command that runs a script in a Blender with factory settings and without a window. Code in a file that the
    script opens does not run."""
    if bpy.app.binary_path:
        background = ("--background", "--factory-startup", "--disable-autoexec", "--python-exit-code", "1")
        return [bpy.app.binary_path, *background, "--python", str(script), "--", *arguments]
    return [sys.executable, *PYTHON_FLAGS, str(script), *arguments]
