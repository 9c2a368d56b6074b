# SPDX-License-Identifier: GPL-3.0-or-later
"""The time of the last change that Blender reported. Slow results are cached and recomputed only after a pause."""

import time

# Seconds without a change after which a drag counts as paused or ended.
STILL = 0.2
_count, _last = 0, 0.0


def note_change() -> None:
    """Note a change; called by Blender's handlers."""
    global _count, _last
    _count, _last = _count + 1, time.monotonic()


def change_count() -> int:
    """The number of changes that Blender reported. A result is up to date while this number stays the same."""
    return _count


def seconds_until_still() -> float:
    """Seconds until nothing has changed for STILL seconds; 0 if that is already so."""
    return max(0.0, _last + STILL - time.monotonic())
