# SPDX-License-Identifier: GPL-3.0-or-later
"""How long work reports its progress: one kind of callback for the whole project."""

from collections.abc import Callable

# progress(stage, fraction): the name of the present stage, and how much is done, from 0 to 1: of the stage, or of the
# whole work where the stages are parts of a whole (span_of).
Progress = Callable[[str, float], None]


def silent(stage: str, fraction: float) -> None:
    """A Progress that does nothing."""


def part_of(progress: Progress, stage: str, *, done: int, total: int) -> Progress:
    """A Progress for one of `total` equal parts of a stage, of which `done` are complete.

    It reports to `progress` under the name `stage`, whatever names the part gives to its own stages."""
    return lambda _, fraction: progress(stage, (done + fraction) / total)


def span_of(progress: Progress, begin: float, end: float) -> Progress:
    """A Progress for work that takes the whole from `begin` to `end`, both from 0 to 1. It keeps the work's names of
    stages. The stages of the work must report how much of the work, not of the stage, is done."""
    return lambda stage, fraction: progress(stage, begin + (end - begin) * fraction)


def forwards(progress: Progress) -> Progress:
    """A Progress that never goes back, as work does that finds that it must do a stage again."""
    furthest = 0.0

    def told(stage: str, fraction: float) -> None:
        nonlocal furthest
        furthest = max(furthest, fraction)
        progress(stage, furthest)

    return told
