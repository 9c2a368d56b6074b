# SPDX-License-Identifier: GPL-3.0-or-later
"""JSON from files that anyone may have written: read strictly, within bounds, or refused in one line.

What passes is smaller than LARGEST_BYTES and nested at most DEEPEST deep. Its numbers are finite, its integers exact in
double precision, and no key stands twice in an object.
"""

import json
import math
from pathlib import Path
from typing import Any

from .failure import GratingError

# A header or a request of ten thousand scans is smaller.
LARGEST_BYTES = 1 << 20
# Records of this project are nested 4 deep.
DEEPEST = 32
# Every integer up to this one is a number of double precision (RFC 8259, section 6).
_LARGEST_INTEGER = 2**53 - 1


def read_json(path: Path, remedy: str) -> Any:
    """The content of a file of JSON in UTF-8.

    Raises GratingError "PATH: fault; REMEDY" if the file cannot be read, or if parse_json refuses its content."""
    try:
        if path.exists() and not path.is_file():  # a fifo would be waited for
            raise GratingError(path, "is no file", remedy)
        with path.open("rb") as file:
            content = file.read(LARGEST_BYTES + 1)
    except (OSError, ValueError) as error:
        raise GratingError(path, f"cannot be read ({getattr(error, 'strerror', None) or error})", remedy) from error
    return parse_json(content, path, remedy)


def parse_json(text: str | bytes, source: str | Path, remedy: str, *, part: str = "") -> Any:
    """The content of a text of JSON; of bytes, in UTF-8.

    `part` is that of the source which holds the text, for the message: "its header: ".

    Raises GratingError "SOURCE: fault; REMEDY" if the text is not JSON or breaks one of the bounds above."""
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


def _integer(digits: str) -> int:
    # Python reads an integer in a time that grows with the square of its digits.
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
    """Whether objects and lists are nested in a value more than `depth` deep."""
    level = [value]
    for _ in range(depth + 1):
        level = [
            inner
            for outer in level
            for inner in (outer.values() if isinstance(outer, dict) else outer if isinstance(outer, list) else ())
        ]
    return bool(level)
