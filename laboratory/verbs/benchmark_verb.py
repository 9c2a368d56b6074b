# SPDX-License-Identifier: GPL-3.0-or-later
"""The `benchmark` verb: speed against error, for every method on the same surfaces."""

import argparse
from pathlib import Path

from precompute.base.failure import GratingError
from precompute.cli.arguments import add_json, path_argument
from precompute.cli.printing import Progress, emit

from ..speed import page
from ..speed.page import PAGE, PART, summary, write_picture
from ..speed.pareto_front import measure_all
from ..speed.surfaces import FULL, QUICK, SHARED
from ..study import plots
from ..study.pages import write_page


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `benchmark`."""
    parser.add_argument(
        "--quick", action="store_true", help="a trial of a minute with small pieces, whose numbers are no result"
    )
    parser.add_argument(
        "-o", "--output", type=path_argument, default=Path("benchmark"), metavar="DIR",
        help=f"folder for {PAGE} and its pictures; default benchmark",
    )  # fmt: skip
    parser.add_argument(
        "--shared", type=path_argument, metavar="DIR", help="folder of real scans; default ../shared/data, if it exists"
    )
    add_json(parser)
    parser.add_argument("--progress", choices=("text", "json", "none"), default="text", help=argparse.SUPPRESS)


def run(arguments: argparse.Namespace) -> None:
    """Run `benchmark`: print the table, write the page and its pictures."""
    if arguments.shared is not None and not arguments.shared.is_dir():
        raise GratingError(arguments.shared, "there is no such folder", "leave --shared out for the sample surfaces")
    plots.pyplot()
    effort = QUICK if arguments.quick else FULL
    result = measure_all(effort, arguments.shared or SHARED, Progress(arguments.progress))
    picture = write_picture(result, arguments.output / "images")
    file = arguments.output / PAGE
    write_page(arguments.output, PAGE, page.text(result), part=PART)
    files = [str(file), str(picture)]
    emit({**result.as_dict(), "files": files}, arguments.json, lambda: [*summary(result).splitlines(), *files])
