# SPDX-License-Identifier: GPL-3.0-or-later
"""Ranges of frames as text, such as "1-24:2, 30": every second frame from 1 to 24, and frame 30."""

import re

# Blender's limits of frames.
FRAME_MIN, FRAME_MAX = -1_048_574, 1_048_574
# An hour at 24 frames a second has 86,400.
FRAMES_MOST = 100_000
_RANGE = re.compile(r"(-?\d{1,7})(?:-(-?\d{1,7})(?::(\d{1,7}))?)?", re.ASCII)


def parse_frames(text: str) -> tuple[int, ...]:
    """The frames of a text, in its order, each once. Raises ValueError, with the faulty part, for any other text, and
    at the part with which there are more than FRAMES_MOST."""
    frames: dict[int, None] = {}
    named = 0
    for part in text.split(","):
        match = _RANGE.fullmatch(part.strip())
        if match is None:
            raise ValueError(part.strip())
        first = int(match[1])
        last, step = int(match[2] or first), int(match[3] or 1)
        if not FRAME_MIN <= first <= last <= FRAME_MAX or step == 0:
            raise ValueError(part.strip())
        named += len(range(first, last + 1, step))
        if named > FRAMES_MOST:
            raise ValueError(part.strip())
        frames.update(dict.fromkeys(range(first, last + 1, step)))
    return tuple(frames)
