# SPDX-License-Identifier: GPL-3.0-or-later
"""`bake`: height maps into the table that the material reads."""

import argparse
from dataclasses import asdict
from pathlib import Path

from ..bake import cache
from ..bake.needs import EVERYTHING, read_needs
from ..bake.output import bake_to_folder
from ..bake.request import BakeRequest
from ..base.failure import GratingError
from .arguments import add_bake_options, add_input, height_map_of
from .output import Progress, emit


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `bake`."""
    add_input(parser, several=True)
    parser.add_argument("-o", "--output", required=True, type=Path, metavar="DIR", help="folder for the bake")
    add_bake_options(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `bake` verb: bake, measure, write."""
    if not 0 < arguments.delta_e < 100:
        raise GratingError(
            f"--delta-e {arguments.delta_e:g}: not a colour difference; give a number from 0 to 100, such as 1"
        )
    order = request_of(arguments)
    height_maps = [height_map_of(arguments, file) for file in arguments.files]
    progress = Progress(arguments.progress)

    def make(folder: Path) -> dict:
        return bake_to_folder(height_maps, order, folder, progress)

    if arguments.no_cache:
        facts = {**make(arguments.output), "cached": False}
    else:
        facts = cache.bake_once(cache.key_of(height_maps, asdict(order)), arguments.output, make, progress)
    emit(facts, arguments.json, lambda: bake_summary(facts))


def request_of(arguments) -> BakeRequest:
    """What the command line asks of a bake."""
    length_m = None if arguments.coherence_um is None else arguments.coherence_um * 1e-6
    needs = EVERYTHING if arguments.needs is None else read_needs(arguments.needs)
    return BakeRequest(arguments.delta_e, length_m, arguments.illuminant, needs, arguments.model)


def bake_summary(facts: dict) -> str:
    """The two lines that a person reads after a bake."""
    de = facts["delta_e"]
    origin = "from the cache, baked in " if facts["cached"] else ""
    return (
        f"{facts['files'][0]}: {facts['tiles']} tiles of {facts['tile'][1]} x {facts['tile'][0]}, "
        f"coherence {facts['coherence_um']:.1f} um, {facts['blender_bytes'] / 2**20:.0f} MiB in Blender, "
        f"{origin}{facts['seconds']:.1f} s\n"
        f"dE00 mean {de['mean']:.2f}, p95 {de['p95']:.2f}, p99 {de['p99']:.2f}, max {de['max']:.2f} "
        f"({de['pairs']} direction pairs, {facts['check_seconds']:.1f} s)"
    )
