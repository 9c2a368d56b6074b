# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile input: thousands of bad inputs, each of which must be taken or refused in one line.

    ./dev bench hostile [SUITE ...] [--count N] [--seed S] [--only NAME] [--json FILE|-]

A suite is a module with `cases(count, seed, folder)`, which yields the cases of about `count` inputs a group, always
the same ones for the same seed. runner.py runs each case in a child process of its own, under limits of time and
memory, and judges it; the program ends with status 1 if any case failed. tests/precompute/hostile runs a few cases of
every suite. The suite `blends` tells its lies in .blend files: blends.py says how.
"""

import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

from precompute.cli.option_types import count
from precompute.cli.parser import OneLineParser

from ..report import add_json, say, write
from . import arguments, blends, headers, meshes, readers, records, runner, verbs

# The suites by their names. Each makes its cases from the count, the seed and a folder for the files of all cases.
SUITES: dict[str, Callable[[int, int, Path], Iterable[runner.Case]]] = {
    "readers": readers.cases,
    "verbs": verbs.cases,
    "headers": headers.cases,
    "meshes": meshes.cases,
    "records": records.cases,
    "arguments": arguments.cases,
}
# The suite whose cases Blender runs.
BLENDS = "blends"


def main(argv: list[str]) -> int:
    """Run suites; the exit status: 1 if any case failed."""
    parser = OneLineParser(prog="hostile", description=__doc__.splitlines()[0])
    parser.add_argument("suites", nargs="*", metavar="SUITE", help=f"of {', '.join((*SUITES, BLENDS))}; default all")
    parser.add_argument(
        "--count", type=count(1, 10**6), default=300, metavar="N", help="inputs of each group; default 300"
    )
    parser.add_argument(
        "--seed", type=count(0, 10**9), default=1, metavar="S", help="other seeds make other inputs; default 1"
    )
    parser.add_argument("--only", default="", metavar="NAME", help="run only the cases whose names begin so")
    add_json(parser)
    asked = parser.parse_args(argv)
    for name in asked.suites:
        if name not in (*SUITES, BLENDS):
            parser.error(f"{name}: no such suite; choose from {', '.join((*SUITES, BLENDS))}")
    facts: dict[str, object] = {"count": asked.count, "seed": asked.seed, "suites": {}}
    failed = False
    for name in asked.suites or (*SUITES, BLENDS):
        with tempfile.TemporaryDirectory(prefix="hostile-") as folder:
            if name == BLENDS:
                outcomes = blends.outcomes(asked.only, Path(folder))
            else:
                found = SUITES[name](asked.count, asked.seed, Path(folder))
                outcomes = [runner.run(case) for case in found if case.name.startswith(asked.only)]
        say(f"{name}, {asked.count} a group, seed {asked.seed}", asked.json)
        say(runner.table(outcomes), asked.json)
        facts["suites"][name] = runner.facts(outcomes)
        failed = failed or any(outcome.verdict == runner.FAILED for outcome in outcomes)
    write(facts, asked.json)
    return 1 if failed else 0
