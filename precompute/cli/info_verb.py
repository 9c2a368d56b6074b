# SPDX-License-Identifier: GPL-3.0-or-later
"""`info`: size, relief and periods of a height map."""

import argparse

from ..surface import quality
from ..surface.height_map import HeightMap
from ..surface.readers.reader_registry import read_other_way
from ..surface.steps.pipeline import level
from .arguments import add_input, add_level, height_map_of
from .printing import emit

# The facts that the text output gives as sentences.
_IN_WORDS = ("gratings", "waviness", "fine", "line_noise", "quality", "levelling")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `info`."""
    add_input(parser)
    add_level(parser, "as scanned")


def run(arguments: argparse.Namespace) -> None:
    """Run the verb `info`."""
    height_map = height_map_of(arguments)
    levelled = level(height_map, arguments.level)

    def other_way() -> HeightMap | None:
        found = read_other_way(height_map)
        return found and level(found, arguments.level).height_map

    described = quality.describe(levelled.height_map, other_way)
    facts = {**described.as_dict(), "levelling": list(levelled.told)}
    others = (f"{key}: {value}" for key, value in facts.items() if key not in _IN_WORDS)
    lines = [*levelled.told, *described.in_words(), *described.quality.in_words(), *others]
    emit(facts, arguments.json, lambda: lines)
