# SPDX-License-Identifier: GPL-3.0-or-later
"""The callback by which long work reports progress."""

from collections.abc import Callable

# progress(stage, fraction): the current stage's name and the fraction done, 0 to 1. The fraction is of the stage, or of
# the whole work if the stages are parts of a whole (span_of).
Progress = Callable[[str, float], None]


def silent(stage: str, fraction: float) -> None:
    """Ignore the progress."""


def part_of(progress: Progress, stage: str, *, done: int, total: int) -> Progress:
    """Return the Progress of the next of `total` equal parts of `stage`, after `done` parts.

    It reports to `progress` under the name `stage` and ignores the part's own stage names."""
    return lambda _, fraction: progress(stage, (done + fraction) / total)


def span_of(progress: Progress, begin: float, end: float) -> Progress:
    """Return the Progress of work that takes the whole from `begin` to `end`, both in [0, 1].

    It keeps the work's stage names. The work must report the fraction of the work, not of its stage."""
    return lambda stage, fraction: progress(stage, begin + (end - begin) * fraction)


def forwards(progress: Progress) -> Progress:
    """Return a Progress whose fraction never decreases, for work that may repeat a stage."""
    furthest = 0.0

    def told(stage: str, fraction: float) -> None:
        nonlocal furthest
        furthest = max(furthest, fraction)
        progress(stage, furthest)

    return told
