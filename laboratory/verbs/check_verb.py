# SPDX-License-Identifier: GPL-3.0-or-later
"""`check`: measures a bake's error again from its files only."""

import argparse
from pathlib import Path

from precompute.bake.request import DELTA_E
from precompute.base.failure import GratingError, Setting
from precompute.cli.arguments import STEP_NM, add_input, count, existing_bake, height_map_of, name_argument, number
from precompute.cli.bake_verb import lamps_line
from precompute.cli.printing import Progress, emit
from precompute.measure.shown_colours import told
from precompute.table import atlas

from ..check.verdict import Verdict, check


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `check`."""
    parser.add_argument("bake", type=name_argument, metavar="BAKE", help=".exr, or a folder that holds one")
    add_input(parser, several="+")
    parser.add_argument(
        "--delta-e",
        type=number(*DELTA_E),
        metavar="DE",
        help="limit of the colour error; default: the limit that the bake was made for",
    )
    parser.add_argument(
        "--groups", type=count(1, 1000), default=2, metavar="N", help="number of values of w; default 2"
    )
    parser.add_argument(
        "--pairs", type=count(1, 10**6), default=4000, metavar="N", help="direction pairs at each w; default 4000"
    )
    parser.add_argument(
        "--step-nm", type=STEP_NM, metavar="NM", help="wavelength step; default 1 to 3, by the width of the kernel"
    )


def run(arguments: argparse.Namespace) -> None:
    """Run the verb `check`: print the error metrics. Raises GratingError if the bake exceeds the requested error."""
    file = existing_bake(arguments.bake)
    if file is None:
        raise GratingError(arguments.bake, "there is no bake", "give the .exr that `bake` wrote, or its folder")
    _check_direction(file)
    verdict = check(
        file,
        [height_map_of(arguments, each) for each in arguments.files],
        delta_e=arguments.delta_e,
        groups=arguments.groups,
        pairs=arguments.pairs,
        step_m=None if arguments.step_nm is None else arguments.step_nm * 1e-9,
        progress=Progress(arguments.progress),
    )
    if arguments.json or not verdict.faults:
        facts = {"bake": str(file), **verdict.as_dict()}
        emit(facts, arguments.json, lambda: check_summary(file, verdict))
    if verdict.faults:
        raise GratingError(file, ", ".join(verdict.faults), "bake it again")


def _check_direction(file: Path) -> None:
    """Raise GratingError for a bake of spread directions. `check` itself tells what else is wrong with a file."""
    try:
        request = atlas.read_header(file)[1].get("request")
    except GratingError:
        return
    if isinstance(request, dict) and request.get("spread_deg") is not None:
        fault = "its directions are spread, which check cannot measure"
        raise GratingError(file, fault, ("bake without ", Setting.SPREAD_DEG))


def check_summary(file: Path, verdict: Verdict) -> tuple[str, ...]:
    """The summary of a check, in lines of text."""
    de = verdict.errors
    rings = ", ".join(
        f"{ring.u_from:g} to {ring.u_to:g}: {ring.relative_dy:.2%}" for ring in verdict.rings if ring.light > 1e-3
    )
    lamps = {lamp: (its.errors.mean, its.errors.p95) for lamp, its in verdict.lamps.items()}
    return (
        f"{file}: asked a dE00 of {verdict.asked:g}, {verdict.seconds:.1f} s",
        f"dE00 mean {de.mean:.2f}, p95 {de.p95:.2f}, p99 {de.p99:.2f}, max {de.max:.2f}, |dY| {de.relative_dy:.2%} "
        f"({de.pairs} direction pairs)",
        f"|dY| by |u|: {rings}; zero order {verdict.zero_order_dy:.1e}",
        *(_wide_line(verdict),) * bool(verdict.wide),
        *filter(None, [lamps_line(lamps)]),
        *filter(None, [told({space: found.as_dict() for space, found in verdict.shown.items()})]),
    )


def _wide_line(verdict: Verdict) -> str:
    """The line on large lamps: the worst of the wider kernels."""
    worst = verdict.worst_wide
    return (
        f"large lamps: dE00 p99 {worst.errors.p99:.2f} at worst, under a kernel of {worst.sigma:.3f} "
        f"(blur level {worst.level:g} of {(len(verdict.wide) + 1) // 2}); claimed {verdict.wide_claimed:.2f}"
    )
