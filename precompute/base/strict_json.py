# SPDX-License-Identifier: GPL-3.0-or-later
"""Strict reader of JSON from untrusted files; invalid JSON gives a one-line error.

It accepts at most LARGEST_BYTES, nesting up to DEEPEST, finite numbers, integers that double precision holds exactly,
and objects without repeated keys."""

import json
import math
from pathlib import Path
from typing import Any

from .failure import GratingError
from .files import read_limited

# A header or a request with ten thousand scans is smaller.
LARGEST_BYTES = 1 << 20
# Records of this project are nested 4 deep.
DEEPEST = 32
# Double precision holds every integer up to this one exactly (RFC 8259, section 6).
_LARGEST_INTEGER = 2**53 - 1


def read_json(path: Path, remedy: str) -> Any:
    """Read a JSON file in UTF-8.

    Raises GratingError "PATH: fault; REMEDY" if the file cannot be read or parse_json refuses its content."""
    return parse_json(read_limited(path, LARGEST_BYTES, remedy), path, remedy)


def parse_json(text: str | bytes, source: str | Path, remedy: str, *, part: str = "") -> Any:
    """Parse JSON text, or bytes in UTF-8. `part` says in an error which part of the source it is: "its header: ".

    Raises GratingError "SOURCE: fault; REMEDY" if the text is not JSON or breaks a limit of this module."""
    try:
        if len(text) > LARGEST_BYTES:
            raise ValueError(f"larger than {LARGEST_BYTES >> 10} KiB")
        if isinstance(text, bytes):
            text = text.decode("utf-8-sig")
        found = json.loads(
            text, parse_int=_integer, parse_float=_finite, parse_constant=_finite, object_pairs_hook=_without_doubles
        )
        if _is_deeper(found, DEEPEST):
            raise RecursionError
    except RecursionError as error:
        raise GratingError(source, f"{part}not JSON that can be used (nested too deeply)", remedy) from error
    except ValueError as error:
        raise GratingError(source, f"{part}not JSON that can be used ({error})", remedy) from error
    return found


def number_in(source: str, key: str, value: Any, *, limits: tuple[float, float]) -> float:
    """A number of a record, within limits. Raises GratingError, with `source` and the key, for any other value."""
    low, high = limits
    if type(value) not in (int, float) or not low <= value <= high:
        raise GratingError(source, f"{key}: cannot be {value!r:.30}", f"give a number from {low:g} to {high:g}")
    return float(value)


def _integer(digits: str) -> int:
    # Python's time to parse an integer grows with the square of its digits.
    if len(digits) > 17 or abs(number := int(digits)) > _LARGEST_INTEGER:
        raise ValueError(f"an integer of {len(digits)} digits")
    return number


def _finite(digits: str) -> float:
    number = float(digits)
    if not math.isfinite(number):
        raise ValueError(f"{digits[:20]} is no finite number")
    return number


def _without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a key stands twice")
    return found


def _is_deeper(value: Any, depth: int) -> bool:
    """Whether a value nests objects and lists more than `depth` deep."""
    level = [value]
    for _ in range(depth + 1):
        level = [
            inner
            for outer in level
            for inner in (outer.values() if isinstance(outer, dict) else outer if isinstance(outer, list) else ())
        ]
    return bool(level)
