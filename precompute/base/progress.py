# SPDX-License-Identifier: GPL-3.0-or-later
"""How long work reports its progress: one kind of callback for the whole project."""

from collections.abc import Callable

# progress(stage, fraction): the name of the present stage, and how much of it is done, from 0 to 1.
Progress = Callable[[str, float], None]


def silent(stage: str, fraction: float) -> None:
    """A Progress that does nothing."""


def part_of(progress: Progress, stage: str, *, done: int, total: int) -> Progress:
    """A Progress for one of `total` equal parts of a stage, of which `done` are complete.

    It reports to `progress` under the name `stage`, whatever names the part gives to its own stages."""
    return lambda _, fraction: progress(stage, (done + fraction) / total)
