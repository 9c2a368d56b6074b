# SPDX-License-Identifier: GPL-3.0-or-later
"""Malformed command lines for every verb of `./dev grating`.

In each verb's group every line has at least one fault, so accepting it is a failure. Lines of the group `paths` hold
odd paths and may be accepted or refused."""

import argparse
import os
import random
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from laboratory.verbs import PACKAGES
from precompute.cli.parser import build_parser

from .mutations import WORDS
from .runner import Case, run_verb

# Values that most options refuse.
_WRONG = (
    *(word.decode() for word in WORDS if word not in (b"0", b"1e9", b"1000000000")),
    "--", "-", " ", "-1e-9", "1e400", "1e-320", "1_000", " 2", "2\n", "3\n4", "0x10", "2,5", "1e", ".", "１２", "٣",
    "²", "−2", "\udcff", "NaN", "Infinity", "True", "None", "[]", "{}", "9" * 100_000, "1e99999999999", "x" * 100_000,
    "$(id)", "`id`", "%s", "{0}", "\x1b[2J", "\u202e2", "2\0",
)  # fmt: skip
# The shortest valid line of each verb; FOLDER stands for the output folder.
_LINES = {
    "info": ["sample:flat"],
    "bake": ["sample:flat", "-o", "FOLDER/out"],
    "dft": ["sample:blazed", "-o", "FOLDER/out", "--terms", "1"],
    "check": ["FOLDER/none.exr", "sample:flat"],
    "map": ["sample:flat", "-o", "FOLDER/out.png", "--size", "8"],
    "evaluate": ["sample:flat"],
    "efficiency": ["binary", "--period-um", "2", "--depth-nm", "100", "--wavelength-nm", "500"],
    "benchmark": ["--quick", "-o", "FOLDER/out"],
    "comb": ["FOLDER/none.npz", "-o", "FOLDER/out"],
    "unwrap": ["FOLDER/none.npz", "-o", "FOLDER/out"],
    "job": ["FOLDER/none.toml", "--list"],
    "cache": ["prune", "--dry-run"],
}


def cases(count: int, seed: int, folder: Path) -> Iterator[Case]:
    """Yield `count` lines for each verb, and `count` lines with odd paths."""
    parsers = build_parser(tuple(_LINES), PACKAGES)._subparsers._group_actions[0].choices
    assert set(parsers) == set(_LINES)
    parsers = parsers | {"cache": parsers["cache"]._subparsers._group_actions[0].choices["prune"]}
    for verb, parser in parsers.items():
        for number in range(count):
            draw = random.Random(f"{seed} {verb} {number}")
            what, argv = _spoiled(draw, verb, parser, folder)
            yield Case(f"{verb} {number}: {what}", verb, partial(_refuse, argv))
    places = _places(folder)
    for number in range(count):
        draw = random.Random(f"{seed} paths {number}")
        argv = _with_paths(draw, places, folder)
        yield Case(f"paths {number}: {_told(argv)}", "paths", partial(run_verb, argv))


def _spoiled(draw: random.Random, verb: str, parser: argparse.ArgumentParser, folder: Path) -> tuple[str, list[str]]:
    """A description and a line with one to three faults, each of which must make the verb refuse it."""
    argv, told = [word.replace("FOLDER", str(folder)) for word in _LINES[verb]], []
    for _ in range(draw.choice((1, 1, 2, 3))):
        fault = _fault(draw, parser)
        told.append(_told(fault))
        at = draw.choice((0, len(argv)))
        argv[at:at] = fault
    return " and ".join(told), [verb, *argv]


def _fault(draw: random.Random, parser: argparse.ArgumentParser) -> list[str]:
    """Words that make any line of the verb invalid."""
    options = [action for action in parser._actions if action.option_strings and action.nargs != 0]
    action = draw.choice(options)
    name = draw.choice(action.option_strings)
    if draw.random() < 0.15:
        return draw.choice(([name, "--"], [f"{name}=--"], ["--surplus"], [f"--{'x' * 5000}"], ["--size-um=1=2\n"]))
    wrong = [value for value in _WRONG if not _takes(action, value)]
    value = draw.choice(wrong) if wrong else ""
    joined = name.startswith("--") and draw.random() < 0.5
    return [f"{name}={value}"] if joined else [name, value]


def _takes(action: argparse.Action, value: str) -> bool:
    """Whether an option accepts a value: some angles accept 1e-308, and a file option accepts any word."""
    if action.choices:
        return value in map(str, action.choices)
    try:
        action.type(value)
    except argparse.ArgumentTypeError:
        return False
    return True


def _places(folder: Path) -> list[str]:
    """Odd paths, inside the folder and elsewhere."""
    odd = folder / "odd"
    odd.mkdir()
    os.mkfifo(odd / "pipe")
    (odd / "loop").symlink_to(odd / "loop")
    (odd / "empty.exr").touch()
    (odd / "empty.json").touch()
    (odd / "deep.json").write_text("[" * 100_000)
    (odd / "shut").mkdir(mode=0)
    in_folder = (
        "pipe",
        "loop",
        "loop/x",
        "empty.exr",
        "empty.json",
        "deep.json",
        "shut/x",
        "empty.exr/x",
        "none/x",
        ".",
    )
    far = (
        "/dev/null",
        "/dev/zero",
        "/dev/full",
        "/proc/self/mem",
        "/proc/self/environ",
        "/",
        "",
        "a" * 300,
        "a/" * 200,
    )
    return [*(str(odd / name) for name in in_folder), *far, "\udcff", "\n", "sample:\n", "-", "\x1b[2J", "~", "*"]


def _with_paths(draw: random.Random, places: list[str], folder: Path) -> list[str]:
    """A line with odd paths, which is quick to run if it is accepted."""
    place = draw.choice(places)
    written = str(folder / "out" / "a.png")
    return draw.choice((
        ["info", place],
        ["info", place, "--size-um", "4", "--height-nm", "100"],
        ["info", "sample:flat", "--channel", place],
        ["info", f"sample:{place}"],
        ["info", f"grating:{place}"],
        ["info", f"grating:pits?{place}"],
        ["check", place, "sample:flat"],
        ["check", place, place],
        ["map", place, "-o", written, "--size", "8"],
        ["map", f"{place}.exr", "-o", written, "--size", "8"],
        ["bake", "--request", place, "-o", written],
        ["bake", "sample:flat", "--needs", place, "-o", written],
        ["bake", place, "-o", written],
        ["dft", place, "-o", written],
        ["evaluate", place],
        ["benchmark", "--quick", "--shared", place, "-o", str(folder / "odd" / "empty.exr")],
    ))  # fmt: skip


def _refuse(argv: list[str]) -> None:
    run_verb(argv)
    raise AssertionError(f"taken: {_told(argv)}")


def _told(argv: list[str]) -> str:
    return " ".join(ascii(word if len(word) <= 24 else f"{word[:12]}...{len(word)}") for word in argv)
