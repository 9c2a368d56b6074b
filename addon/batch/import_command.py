# SPDX-License-Identifier: GPL-3.0-or-later
"""`import`: add a height map to the open file's scene."""

import argparse
from pathlib import Path

import bpy

from ...precompute.cli.arguments import add_input
from ...precompute.cli.printing import emit
from ...precompute.surface.height_map import is_synthetic
from ..gratings.wording import in_one_line
from ..workflow.importing import add_grating
from .chosen import add_save, save


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `import`."""
    add_input(parser)
    add_save(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `import` verb."""
    source = arguments.file if is_synthetic(arguments.file) else str(Path(arguments.file).resolve())
    sizes = {"size_um": arguments.size_um or 0.0, "height_nm": arguments.height_nm or 0.0}
    grating = add_grating(bpy.context.scene, source, **sizes, channel=arguments.channel or "")
    save(arguments.save)
    summary = in_one_line(grating.summary)
    emit({"name": grating.name, "summary": summary}, arguments.json, lambda: [summary])
