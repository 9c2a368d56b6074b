# SPDX-License-Identifier: GPL-3.0-or-later
"""The verbs of scans and bakes: `import`, `bake` and `needs`. A grating keeps the whole request of its bake, so its
button can repeat it."""

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import bpy

from ...precompute.base.failure import GratingError, printable
from ...precompute.base.files import write_whole
from ...precompute.cli.arguments import add_bake_options, add_input, add_json, add_progress, count, path_argument
from ...precompute.cli.bake_verb import add_preset_option, bake_summary, progress_of, request_of
from ...precompute.cli.printing import emit
from ...precompute.surface.height_map import is_synthetic
from ..gratings.wording import in_one_line
from ..workflow.baking import bake_and_wait, finished_bake, measure_needs, no_smaller, record_bake, request_with
from ..workflow.importing import add_averaged, add_grating
from ..workflow.presets import add_preset
from .shared_options import add_grating_option, add_save, chosen_grating, save

_FRAME = count(-(1 << 20), 1 << 20)


def import_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `import`."""
    add_input(parser)
    add_save(parser)


def run_import(arguments: argparse.Namespace) -> None:
    """The `import` verb."""
    source = arguments.file if is_synthetic(arguments.file) else str(Path(arguments.file).resolve())
    sizes = {"size_um": arguments.size_um or 0.0, "height_nm": arguments.height_nm or 0.0}
    grating = add_grating(bpy.context.scene, source, **sizes, channel=arguments.channel or "")
    save(arguments.save)
    summary = in_one_line(grating.summary)
    emit({"name": grating.name, "summary": summary}, arguments.json, lambda: [summary])


def bake_options(parser: argparse.ArgumentParser) -> None:
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


def run_bake(arguments: argparse.Namespace) -> None:
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


def needs_options(parser: argparse.ArgumentParser) -> None:
    """The arguments of `needs`."""
    parser.add_argument(
        "-o", "--output", type=path_argument, metavar="NEEDS.json", help="write the needs here, for `bake --needs`"
    )
    add_grating_option(parser)
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


def run_needs(arguments: argparse.Namespace) -> None:
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
    told: GratingError | str | None = measured.why_pointless
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
