# SPDX-License-Identifier: GPL-3.0-or-later
"""Option types for argparse: numbers in a range, and non-empty texts.

Python parses `nan`, `1e-308`, `1_000` and the digits of every script as numbers. These types accept only plain decimal
numbers, within the range that makes sense for the option.
"""

import argparse
import re
from collections.abc import Callable
from pathlib import Path

from ..render_job.frame_ranges import parse_frames

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?", re.ASCII | re.IGNORECASE)
_COUNT = re.compile(r"[+-]?\d+", re.ASCII)
# The greatest length of a number's text.
_LONGEST = 40


def number(low: float, high: float) -> Callable[[str], float]:
    """The type of an option that takes a number from low to high."""

    def read(text: str) -> float:
        if len(text) <= _LONGEST and _NUMBER.fullmatch(text) and low <= float(text) <= high:
            return float(text)
        raise argparse.ArgumentTypeError(f"{_shown(text)}: give a number from {low:g} to {high:g}")

    return read


def count(low: int, high: int) -> Callable[[str], int]:
    """The type of an option that takes a whole number from low to high."""

    def read(text: str) -> int:
        if len(text) <= _LONGEST and _COUNT.fullmatch(text) and low <= int(text) <= high:
            return int(text)
        raise argparse.ArgumentTypeError(f"{_shown(text)}: give a whole number from {low} to {high}")

    return read


def name_argument(text: str) -> str:
    """Parse the name of a file or of a channel."""
    if not text:
        raise argparse.ArgumentTypeError("is empty; give a name")
    return text


def path_argument(text: str) -> Path:
    """Parse a path."""
    return Path(name_argument(text))


def frames_argument(text: str) -> tuple[int, ...]:
    """Parse ranges of frames, such as 1-24:2,30."""
    try:
        return parse_frames(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{_shown(str(error))}: give ranges such as 1-24:2,30") from error


def _shown(text: str) -> str:
    return repr(text if len(text) <= _LONGEST else f"{text[: _LONGEST - 3]}...")
