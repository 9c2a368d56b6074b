# SPDX-License-Identifier: GPL-3.0-or-later
"""`info`: size, relief and periods of a height map."""

import argparse

from ..surface import description
from .arguments import add_input, height_map_of
from .output import emit


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `info`."""
    add_input(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `info` verb."""
    facts = description.describe(height_map_of(arguments)).as_dict()
    emit(facts, arguments.json, lambda: "\n".join(f"{key}: {value}" for key, value in facts.items()))
