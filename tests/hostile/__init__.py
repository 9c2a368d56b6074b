# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile input: thousands of bad inputs, each of which must be accepted or refused with a one-line error.

    python -m tests.hostile [SUITE ...] [--count N] [--seed S] [--only NAME]

A suite is a module with `cases(count, seed, folder)`, which yields about `count` cases a group; the same seed gives the
same cases. runner.py runs each case in its own child process with limits of time and memory, and judges it. The program
exits with status 1 if any case failed. tests/precompute/hostile runs a few cases of every suite. blends.py puts wrong
values and edits into .blend files; tests/addon/materials/test_lies.py runs it."""

import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path

from precompute.cli.arguments import count
from precompute.cli.parser import OneLineParser

from . import arguments, headers, meshes, readers, records, runner, verbs

# The suites by name. Each function takes the count, the seed and a folder for the files of its cases.
SUITES: dict[str, Callable[[int, int, Path], Iterable[runner.Case]]] = {
    "readers": readers.cases,
    "verbs": verbs.cases,
    "headers": headers.cases,
    "meshes": meshes.cases,
    "records": records.cases,
    "arguments": arguments.cases,
}


def main(argv: list[str]) -> int:
    """Run suites; return the exit status, 1 if any case failed."""
    parser = OneLineParser(prog="hostile", description=__doc__.splitlines()[0])
    parser.add_argument("suites", nargs="*", metavar="SUITE", help=f"of {', '.join(SUITES)}; default all")
    parser.add_argument("--count", type=count(1, 10**6), default=300, help="inputs of each group; default 300")
    parser.add_argument("--seed", type=count(0, 10**9), default=1, help="other seeds make other inputs; default 1")
    parser.add_argument("--only", default="", metavar="NAME", help="run only the cases whose names begin so")
    asked = parser.parse_args(argv)
    failed = False
    for name in asked.suites or SUITES:
        if name not in SUITES:
            parser.error(f"{name}: no such suite; choose from {', '.join(SUITES)}")
        with tempfile.TemporaryDirectory(prefix="hostile-") as folder:
            found = SUITES[name](asked.count, asked.seed, Path(folder))
            outcomes = [runner.run(case) for case in found if case.name.startswith(asked.only)]
        print(f"{name}, {asked.count} a group, seed {asked.seed}\n{runner.table(outcomes)}", flush=True)
        failed = failed or any(outcome.verdict == runner.FAILED for outcome in outcomes)
    return int(failed)
