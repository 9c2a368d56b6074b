# SPDX-License-Identifier: GPL-3.0-or-later
"""Saving the file that a verb has changed."""

import argparse
from pathlib import Path

import bpy

from ...precompute.base.failure import GratingError
from ...precompute.cli.option_types import path_argument


def add_save(parser: argparse.ArgumentParser) -> None:
    """Add the option for the path of the saved file."""
    parser.add_argument("--save", type=path_argument, metavar="BLEND", help="save the file here; default: in place")


def save(path: Path | None) -> None:
    """Save the open file, to a path or in place. Raises GratingError if it was never saved and no path is given."""
    target = str(path.resolve()) if path else bpy.data.filepath
    if not target:
        raise GratingError("", "the scene has no file yet", "give --save FILE.blend")
    bpy.ops.wm.save_as_mainfile(filepath=target)
