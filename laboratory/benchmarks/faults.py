# SPDX-License-Identifier: GPL-3.0-or-later
"""Faults of disks, paths, clocks, processes and memory, each injected for real: what a user sees, and what is lost.

    ./dev --bpy 5.2 bench faults [--only TEXT] [--kills 20] [--json FILE|-]

Each fault hits a bake, outside Blender (faults_bake.py) or in it (faults_blender.py). A fault fails if it ends in a
traceback, prints more than one line of error, changes a file that was there before, or leaves an unfinished file. The
program exits with status 1 if any fault failed. tests/precompute/test_faults.py runs the faults outside Blender."""

import tempfile
from pathlib import Path

from precompute.cli.arguments import count, name_argument
from precompute.cli.parser import OneLineParser

from . import faults_bake, faults_blender, report
from .faults_case import Row, run


def main(argv: list[str]) -> int:
    """Inject the faults; return the exit status, 1 if one failed."""
    parser = OneLineParser(prog="./dev bench faults", description=__doc__.splitlines()[0])
    parser.add_argument("--only", type=name_argument, metavar="TEXT", help="only the faults whose names hold TEXT")
    parser.add_argument("--kills", type=count(1, 1000), default=20, metavar="N", help="killed bakes; default 20")
    report.add_json(parser)
    asked = parser.parse_args(argv)
    cases = [*faults_bake.cases(asked.kills), *faults_blender.CASES]
    rows = []
    report.say("| fault | what the user sees | what is lost |\n|---|---|---|", asked.json)
    for case in cases:
        if not asked.only or asked.only in case.name:
            with tempfile.TemporaryDirectory(prefix="faults-") as folder:
                rows.append(run(case, Path(folder)))
            report.say(_line(rows[-1]), asked.json)
    report.write({"faults": [vars(row) for row in rows]}, asked.json)
    return 1 if any(row.failed for row in rows) else 0


def _line(row: Row) -> str:
    lost = f"skipped: {row.skipped}" if row.skipped else "; ".join(row.failed) or "nothing"
    return f"| {row.fault} | {row.sees} | {lost} |"
