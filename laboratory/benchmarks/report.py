# SPDX-License-Identifier: GPL-3.0-or-later
"""Prints the figures of a benchmark: lines for people, and `--json FILE|-` for programs."""

import argparse
import sys

from precompute.cli.printing import emit


def add_json(parser: argparse.ArgumentParser) -> None:
    """The option that `say` and `write` are given."""
    parser.add_argument("--json", metavar="FILE|-", help="write the figures as JSON")


def say(line: str, target: str | None) -> None:
    """A line for people; on standard error where the JSON goes to standard output."""
    print(line, file=sys.stderr if target == "-" else sys.stdout, flush=True)


def write(facts: dict, target: str | None) -> None:
    """The facts as JSON, if that was asked for."""
    if target:
        emit(facts, target, lambda: [target])
