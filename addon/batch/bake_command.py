# SPDX-License-Identifier: GPL-3.0-or-later
"""`bake`: import a height map and bake it. The grating keeps the whole request, so its button can repeat the bake."""

import argparse
from dataclasses import asdict
from pathlib import Path

import bpy

from ...precompute.cli.arguments import add_bake_options, add_input, path_argument
from ...precompute.cli.bake_verb import add_preset_option, bake_summary, progress_of, request_of
from ...precompute.cli.printing import emit
from ..workflow.baking import bake_and_wait
from ..workflow.importing import add_averaged
from ..workflow.presets import add_preset
from .chosen import add_save, save


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `bake`: those of `python -m precompute bake`, but --output is optional."""
    add_input(parser, several="*")
    parser.add_argument(
        "-o", "--output", type=path_argument, metavar="DIR", help="folder for the bake; default: the cache"
    )
    add_bake_options(parser)
    parser.add_argument(
        "--request",
        type=path_argument,
        metavar="BAKE.exr|JSON",
        help="repeat an earlier bake with the same scans and settings",
    )
    add_preset_option(parser)
    add_save(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `bake` verb. Without an open file it saves only if --save is given."""
    request = request_of(arguments).at(Path.cwd())
    if arguments.preset is None:
        grating = add_averaged(bpy.context.scene, [asdict(scan) for scan in request.scans])
    else:
        grating = add_preset(bpy.context.scene, arguments.preset)
    grating.take_request(request)
    directory = str(arguments.output.resolve()) if arguments.output else ""
    facts = bake_and_wait(grating, directory, use_cache=not arguments.no_cache, progress=progress_of(arguments))
    if bpy.data.filepath or arguments.save:
        save(arguments.save)
    emit(facts, arguments.json, lambda: bake_summary(facts, request.illuminant))
