# SPDX-License-Identifier: GPL-3.0-or-later
"""When Blender last told of a change. What takes long to find out is found once, and again after a change: not at each
step of a lamp that is dragged, but once nothing has changed for a moment."""

import time

# Seconds without a change after which a drag has paused or ended.
STILL = 0.2
_count, _last = 0, 0.0


def note_change() -> None:
    """Note that something changed: Blender's handlers say so."""
    global _count, _last
    _count, _last = _count + 1, time.monotonic()


def change_count() -> int:
    """How many changes there were in this session. If it is as before, nothing has changed that Blender tells of."""
    return _count


def seconds_until_still() -> float:
    """How long to wait until nothing has changed for a moment; 0 if that is so already."""
    return max(0.0, _last + STILL - time.monotonic())
