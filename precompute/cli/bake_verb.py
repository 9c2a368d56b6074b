# SPDX-License-Identifier: GPL-3.0-or-later
"""`bake`: bakes height maps into the table that the material reads."""

import argparse
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..bake import cache
from ..bake.make import LEVELLING, bake_name, bake_to_folder
from ..bake.needs import read_needs
from ..bake.request import BakeRequest, Scan, request_from
from ..base.failure import GratingError
from ..base.progress import span_of
from ..base.strict import read_json
from ..colour.illuminants import FIRST
from ..colour.spaces import RGB_SPACES, lamp_line
from ..measure.errors import stated_errors
from ..measure.shown_colours import told
from ..presets.presets import preset_names, read_preset
from ..table import atlas
from ..table.sample_set import path_beside
from .arguments import add_bake_options, add_input, name_argument, path_argument
from .printing import Progress, emit, refuse_to_replace

# A lamp of each kind: a household bulb, an LED lamp and a fluorescent tube.
_OF_EACH_KIND = ("2700K", "LED-B1", "FL11")
# The warm lamp, and the dE00 beyond which a plain bake's 95th percentile gets a remedy: twice what an eye sees.
_WARM, _FAR_OFF = "2700K", 2.0


def lamps_line(errors: Mapping[str, tuple[float, float]]) -> str:
    """The line on the mean dE00 and the 95th percentile of lamps; "" without a lamp."""
    each = ", ".join(f"{lamp:.40} {mean:.1f} and {p95:.1f}" for lamp, (mean, p95) in errors.items())
    return f"under other lamps (mean dE00, 95th percentile): {each}" if errors else ""


def line_of_bake(delta_e: Mapping[str, Any], illuminant: str) -> str:
    """The line on the lamps in a bake's errors; "" if it has none. It names a remedy where daylight's bake is far off
    under a warm lamp."""
    told = delta_e.get("lamps")
    errors = (
        {lamp: told[lamp] for lamp in _OF_EACH_KIND if _are_errors(told.get(lamp))} if isinstance(told, dict) else {}
    )
    far_off = illuminant == FIRST and errors.get(_WARM, (0.0, 0.0))[1] > _FAR_OFF
    return lamps_line(errors) + "; --illuminant smooth or led holds them" * far_off


def _are_errors(value: object) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(type(each) in (int, float) for each in value)


# The share of a run's time that reading its scans takes, about.
_READ = 0.01
_READING = "reading the scan"
# The options of a bake, each with the field of a request that it sets, and the options that a preset decides.
_FIELDS = {
    "delta_e": "delta_e", "illuminant": "illuminant", "model": "model", "matter": "matter", "level": "levelling",
    "patch_um": "patch_um", "spread_deg": "spread_deg",
}  # fmt: skip
_DECIDED = ("matter", "level", "size_um", "height_nm", "channel")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bake`."""
    add_input(parser, several="*")
    parser.add_argument("-o", "--output", required=True, type=path_argument, metavar="DIR", help="folder for the bake")
    add_bake_options(parser)
    parser.add_argument(
        "--request",
        type=path_argument,
        metavar="BAKE.exr|JSON",
        help="repeat the bake of this request; if its scans are not beside it, FILE says where they are",
    )
    add_preset_option(parser)


def add_preset_option(parser: argparse.ArgumentParser) -> None:
    """Add --preset, after the options of a bake."""
    parser.add_argument(
        "--preset",
        type=name_argument,
        metavar="NAME|JSON",
        help=f"bake a ready-made surface in place of FILE: {', '.join(preset_names())}, or the file of your own",
    )


def run(arguments: argparse.Namespace) -> None:
    """Run the verb `bake`: read the scans, bake them, measure the error, write the files."""
    request = request_of(arguments)
    told = progress_of(arguments)
    height_maps = []
    for number, scan in enumerate(request.scans):
        told(_READING, _READ * number / len(request.scans))
        height_maps.append(scan.read())
    progress = span_of(told, _READ, 1)
    table = arguments.output / f"{bake_name(height_maps)}.exr"
    refuse_to_replace([scan.source for scan in request.scans], [table, path_beside(table)])
    if arguments.no_cache:
        facts = {**bake_to_folder(height_maps, request, arguments.output, progress=progress), "cached": False}
    else:
        facts = cache.cached_bake(height_maps, request, arguments.output, progress=progress)
    lamps = [lamp_line(space, request.illuminant) for space in RGB_SPACES]
    emit(facts, arguments.json, lambda: (*bake_summary(facts, request.illuminant), *filter(None, lamps)))


def progress_of(arguments: argparse.Namespace) -> Progress:
    """The progress of a bake, in the style of --progress."""
    return Progress(arguments.progress, may_be_refused=(_READING, LEVELLING))


def request_of(arguments: argparse.Namespace) -> BakeRequest:
    """The request of the command line: from --request, from --preset and options, or else from FILE and options.

    Raises GratingError for a request that no bake can keep."""
    if arguments.preset is not None:
        return _of_preset(arguments)
    if arguments.request is not None:
        return _found_at(arguments.files, read_request(arguments.request), arguments.request)
    if not arguments.files:
        raise GratingError("", "no height map to bake", "name a FILE, a bake to repeat by --request, or a --preset")
    scans = tuple(Scan(file, arguments.size_um, arguments.height_nm, arguments.channel) for file in arguments.files)
    return BakeRequest(scans=scans, **_given(arguments))


def _given(arguments: argparse.Namespace) -> dict[str, Any]:
    """The fields of a request that options of the command line set."""
    found = {field: getattr(arguments, option) for option, field in _FIELDS.items()}
    found = {field: value for field, value in found.items() if value is not None}
    if arguments.coherence_um is not None:
        found["coherence_length_m"] = arguments.coherence_um * 1e-6
    if arguments.needs is not None:
        found["needs"] = read_needs(arguments.needs)
    return found


def _of_preset(arguments: argparse.Namespace) -> BakeRequest:
    """The request of --preset, with the options that a preset leaves free.

    Raises GratingError if the command line names another surface too, an option that the preset decides, or a model
    that the preset's matter has no place in. The bake's own refusal of that matter would propose another one."""
    what = f"--preset {arguments.preset:.40}"
    if arguments.request is not None or arguments.files:
        other = "a FILE" if arguments.files else "--request"
        raise GratingError(what, f"{other} is given too", "give one of FILE, --request and --preset")
    for name in _DECIDED:
        if getattr(arguments, name) is not None:
            option = f"--{name.replace('_', '-')}"
            raise GratingError(what, f"{option} is given too", f"leave {option} out, as the preset decides it")
    request = replace(read_preset(arguments.preset).request, **_given(arguments))
    if request.model == "patch" and request.matter.baked:
        fault = f"the patch model takes only a dielectric, and the preset is of {request.matter}"
        raise GratingError(what, fault, "take --model ensemble")
    return request


def _found_at(files: list[str], request: BakeRequest, source: Path) -> BakeRequest:
    """The request with its scans at the paths `files`, one for each scan, in order.

    Without paths the request stays as it is. Raises GratingError for another number of paths."""
    if not files:
        return request
    if len(files) != len(request.scans):
        raise GratingError(
            source, f"the request has {len(request.scans)} scans, not {len(files)}", "name a FILE for each, in order"
        )
    scans = zip(request.scans, files, strict=True)
    return replace(request, scans=tuple(replace(scan, source=file) for scan, file in scans))


def read_request(path: Path) -> BakeRequest:
    """Read the request in a JSON file or in the header of a bake's .exr. Its scans are searched for beside the file.

    Raises GratingError if the file holds no request, or one without scans."""
    if path.suffix.lower() == ".exr":
        _, header = atlas.read_header(path)
        record = header.get("request")
    else:
        record = read_json(path, "give the .exr that `bake` wrote, or the JSON of a request")
    request = request_from(record, str(path)).at(path.resolve().parent)
    if not request.scans:
        raise GratingError(path, "the request names no scan", "add one under `scans`")
    return request


def bake_summary(facts: Mapping[str, Any], illuminant: str) -> tuple[str, ...]:
    """The summary of a bake under an illuminant, in lines of text."""
    de = facts["delta_e"]
    origin = "from the cache, baked in " if facts["cached"] else ""
    return (
        f"{facts['files'][0]}: {facts['tiles']} tiles of {facts['tile'][1]} x {facts['tile'][0]}, "
        f"coherence {facts['coherence_um']:.1f} um, {facts['blender_bytes'] / 2**20:.0f} MiB in Blender, "
        f"{origin}{facts['seconds']:.1f} s",
        f"dE00 mean {de['mean']:.2f}, p95 {de['p95']:.2f}, p99 {de['p99']:.2f}, max {de['max']:.2f} "
        f"({de['pairs']} direction pairs)",
        *stated_errors(de),
        *filter(None, [line_of_bake(de, illuminant), told(facts.get("shown", {}))]),
        *_of_energy(facts["largest_albedo"]),
        *facts.get("levelling", ()),
        f"self-check {facts['check_seconds']:.1f} s",
    )


def _of_energy(largest_albedo: float) -> tuple[str, ...]:
    """The line on the number by which the light is divided, if it is not 1."""
    if largest_albedo == 1:
        return ()
    return (f"light divided by {largest_albedo:.3f}, so that no direction sends back more light than arrives",)
