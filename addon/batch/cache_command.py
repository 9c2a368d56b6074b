# SPDX-License-Identifier: GPL-3.0-or-later
"""`cache`: list, prune or verify the cache of bakes."""

import argparse

from ...precompute.cli import cache_verb
from ..gratings.cache_folder import cache_folder


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The arguments of `cache`."""
    cache_verb.add_arguments(parser)


def run(arguments: argparse.Namespace) -> None:
    """The `cache` verb, on the cache of the extension. The files that scenes refer to are no part of it."""
    cache_verb.run_in(cache_folder(), arguments)
