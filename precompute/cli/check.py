# SPDX-License-Identifier: GPL-3.0-or-later
"""`check`: a bake's error recomputed from its files alone."""

import argparse
from pathlib import Path

from ..base.failure import GratingError
from ..check.verdict import Verdict, check
from .arguments import add_input, existing_bake, height_map_of
from .output import Progress, emit


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `check`."""
    parser.add_argument("bake", metavar="BAKE", help=".exr, or a folder that holds one")
    add_input(parser, several="+")
    parser.add_argument(
        "--delta-e",
        type=float,
        metavar="DE",
        help="colour difference that the bake must keep; default: the one that was asked of it",
    )
    parser.add_argument("--groups", type=int, default=2, metavar="N", help="number of values of w; default 2")
    parser.add_argument("--pairs", type=int, default=4000, metavar="N", help="direction pairs at each w; default 4000")
    parser.add_argument(
        "--step-nm", type=float, metavar="NM", help="wavelength step; default 1 to 3, by the width of the kernel"
    )


def run(arguments: argparse.Namespace) -> None:
    """The `check` verb: print the error metrics. Raises GratingError if the bake does not keep what was asked of it."""
    if arguments.delta_e is not None and not 0 < arguments.delta_e < 100:
        raise GratingError(f"--delta-e {arguments.delta_e:g}: not a colour difference; give a number from 0 to 100")
    for option, most in (("groups", 1000), ("pairs", 10**6)):
        if not 1 <= getattr(arguments, option) <= most:
            raise GratingError(f"--{option} {getattr(arguments, option)}: not a count; give 1 to {most}")
    if arguments.step_nm is not None and not 0.1 <= arguments.step_nm <= 100:
        raise GratingError(f"--step-nm {arguments.step_nm:g}: not a wavelength step; give 0.1 to 100")
    file = existing_bake(arguments.bake)
    if file is None:
        raise GratingError(f"{arguments.bake}: there is no bake; give the .exr that `bake` wrote, or its folder")
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
        raise GratingError(f"{file}: {', '.join(verdict.faults)}; bake it again")


def check_summary(file: Path, verdict: Verdict) -> str:
    """The two lines that a person reads after a check."""
    de = verdict.errors
    rings = ", ".join(
        f"{ring.u_from:g} to {ring.u_to:g}: {ring.relative_dy:.2%}" for ring in verdict.rings if ring.light > 1e-3
    )
    return (
        f"{file}: dE00 mean {de.mean:.2f}, p95 {de.p95:.2f}, p99 {de.p99:.2f}, max {de.max:.2f} "
        f"(asked {verdict.asked:g}; {de.pairs} direction pairs, {verdict.seconds:.1f} s)\n"
        f"|dY| {de.relative_dy:.2%} of the light (by |u|: {rings}), zero order {verdict.zero_order_dy:.1e}"
    )
