# SPDX-License-Identifier: GPL-3.0-or-later
"""`needs`: measure which part of a bake the open file's scene needs, write a needs file, and bake only that part."""

import argparse
import json
import sys
from typing import Any

import bpy

from ...precompute.base.failure import GratingError, printable
from ...precompute.base.files import write_whole
from ...precompute.cli.arguments import add_json, add_progress, count, path_argument
from ...precompute.cli.bake_verb import progress_of
from ...precompute.cli.printing import emit
from ..gratings.wording import in_one_line
from ..workflow.baking import finished_bake, measure_needs, no_smaller, record_bake, request_with
from .chosen import add_grating, add_save, chosen_grating, save

_FRAME = count(-(1 << 20), 1 << 20)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `needs`."""
    parser.add_argument(
        "-o", "--output", type=path_argument, metavar="NEEDS.json", help="write the needs here, for `bake --needs`"
    )
    add_grating(parser)
    parser.add_argument(
        "--frames", nargs=2, type=_FRAME, metavar=("FIRST", "LAST"),
        help="measure this range; default: the scene's range if something moves, else the present frame",
    )  # fmt: skip
    parser.add_argument(
        "--bake",
        action="store_true",
        help="bake only that, switch the grating to it, and save the file, unless it saves less than a tenth of memory",
    )
    add_json(parser)
    add_progress(parser)
    add_save(parser)
    parser.set_defaults(output_is_file=True)


def run(arguments: argparse.Namespace) -> None:
    """The `needs` verb."""
    scene = bpy.context.scene
    if arguments.output is None and not arguments.bake:
        raise GratingError("", "neither -o nor --bake is given", "name a file for the needs, or have them baked")
    first, last = arguments.frames or (0, 0)
    if last < first:
        raise GratingError(f"--frames {first} {last}", "the last comes before the first", "give them in their order")
    grating = chosen_grating(scene, arguments.grating)
    progress = progress_of(arguments)
    measured = measure_needs(scene, grating, (first, last) if arguments.frames else None, progress=progress)
    facts: dict[str, Any] = {"needs": measured.as_dict(), "report": measured.lines}
    lines = measured.lines
    if arguments.output is not None:
        text = json.dumps(measured.as_dict(), indent=1) + "\n"
        write_whole(arguments.output, lambda partial: partial.write_text(text, encoding="utf-8"))
    told: GratingError | str | None = measured.pointless
    if arguments.bake and not told:
        request = request_with(grating, measured.needs)
        facts["bake"] = finished_bake(grating, request=request, progress=progress)
        told = no_smaller(grating, facts["bake"])
        if not told:
            record_bake(grating, facts["bake"], request, taken_over=True)
            lines = [*lines, f"{grating.name}: {in_one_line(grating.bake_summary)}"]
            save(arguments.save)
    facts["nothing_to_gain"] = bool(told)
    if told:
        print(printable(told), file=sys.stderr)
        if arguments.save is not None:
            save(arguments.save)
    emit(facts, arguments.json, lambda: map(printable, lines))
