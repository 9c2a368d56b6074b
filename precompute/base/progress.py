# SPDX-License-Identifier: GPL-3.0-or-later
"""How work that takes long tells what it is doing: one kind of callback for the whole project."""

from collections.abc import Callable

# progress(stage, fraction): the name of the stage, and the share of it that is done, from 0 to 1.
Progress = Callable[[str, float], None]


def silent(stage: str, fraction: float) -> None:
    """A Progress that tells nobody."""


def part_of(progress: Progress, stage: str, done: int, total: int) -> Progress:
    """A Progress that tells part number `done` of `total` equal parts of a stage, whatever the part's own stages are
    called."""
    return lambda _, fraction: progress(stage, (done + fraction) / total)
