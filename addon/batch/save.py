# SPDX-License-Identifier: GPL-3.0-or-later
"""Saving the file that a verb has changed."""

import argparse
from pathlib import Path

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.cli.option_types import path_argument
from ..blender.written import save_copy


def add_save(parser: argparse.ArgumentParser) -> None:
    """Add the option for the path of the saved file."""
    parser.add_argument("--save", type=path_argument, metavar="BLEND", help="save the file here; default: in place")


def save(path: Path | None) -> None:
    """Save the open file, whole or not at all, to a path or in place; a file that was there stays as .blend1, unless
    the preferences want no versions. Raises GratingError if it was never saved and no path is given, or if it cannot be
    written."""
    if path is None and not bpy.data.filepath:
        raise GratingError("", "the scene has no file yet", "give --save FILE.blend")
    target = Path(path or bpy.data.filepath).resolve()
    save_copy(target, keep=bpy.context.preferences.filepaths.save_version > 0)
