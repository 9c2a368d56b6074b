# SPDX-License-Identifier: GPL-3.0-or-later
"""`assets`: write the presets as an asset library into a folder, for example on a studio's share."""

import argparse

from ...precompute.cli.arguments import add_json, add_progress, path_argument
from ...precompute.cli.printing import Progress, emit
from ...precompute.presets.presets import preset_names
from ..assets.library import make_and_wait, summary_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `assets`."""
    parser.add_argument(
        "-o", "--output", type=path_argument, metavar="DIR", required=True, help="folder of the asset library"
    )
    parser.add_argument(
        "--preset", action="append", choices=preset_names(), metavar="NAME", help="only this preset; repeatable"
    )
    add_json(parser)
    add_progress(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `assets` verb. The open file and Blender's preferences stay as they are."""
    folder = arguments.output.resolve()
    files = make_and_wait(folder, arguments.preset or (), progress=Progress(arguments.progress))
    facts = {"files": [str(file) for file in files], "bytes": sum(file.stat().st_size for file in files)}
    emit(facts, arguments.json, lambda: [f"{folder}: {summary_of(files)}; add it in Preferences > File Paths"])
