# SPDX-License-Identifier: GPL-3.0-or-later
"""`info`: size, relief and periods of a height map."""

import argparse

from ..surface import description
from ..surface.steps.pipeline import level
from .arguments import add_input, add_level, height_map_of
from .output import emit

# The facts that people read as sentences.
_IN_WORDS = ("gratings", "waviness", "fine", "line_noise", "quality", "levelling")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `info`."""
    add_input(parser)
    add_level(parser, "as scanned")


def run(arguments: argparse.Namespace) -> None:
    """The `info` verb."""
    levelled = level(height_map_of(arguments), arguments.level)
    described = description.describe(levelled.height_map)
    facts = {**described.as_dict(), "levelling": list(levelled.told)}
    others = (f"{key}: {value}" for key, value in facts.items() if key not in _IN_WORDS)
    lines = [*levelled.told, *described.in_words(), *described.quality.in_words(), *others]
    emit(facts, arguments.json, lambda: lines)
