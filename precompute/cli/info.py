# SPDX-License-Identifier: GPL-3.0-or-later
"""`info`: size, relief and periods of a height map."""

import argparse

from ..surface import description
from .arguments import add_input, height_map_of
from .output import emit

# The facts that people read as sentences.
_IN_WORDS = ("gratings", "waviness", "fine")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `info`."""
    add_input(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `info` verb."""
    described = description.describe(height_map_of(arguments))
    facts = described.as_dict()
    lines = [*described.in_words(), *(f"{key}: {value}" for key, value in facts.items() if key not in _IN_WORDS)]
    emit(facts, arguments.json, lambda: lines)
