# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of TIFF directories, for instruments that keep maps in private tags or several pages.

It reads only requested tags. (Format: TIFF 6.0, section 2.)"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, BinaryIO

from .scan_file import Block, read_exactly

_MARKS = {b"II*\0": "<", b"MM\0*": ">"}
_LETTERS = {1: "B", 2: "s", 3: "H", 4: "I", 6: "b", 7: "s", 8: "h", 9: "i", 11: "f", 12: "d"}
# The most tags of all pages together. A JPK file of a hundred channels has some thousands.
_TAGS_MAX = 20_000
# The most numbers or characters of a tag, enough for the strips of the tallest picture.
_ITEMS_MAX = 1 << 17
_COLS, _ROWS, _BITS, _PACKING, _STRIPS, _STRIP_BYTES, _FORMAT = 256, 257, 258, 259, 273, 279, 339
_FORMATS = {1: "u", 2: "i", 3: "f"}


@dataclass(frozen=True)
class Tag:
    """The location of a tag's value: byte order, type and count of its items, and first byte."""

    order: str
    kind: int
    count: int
    start: int

    def items(self, file: BinaryIO) -> tuple[Any, ...]:
        """Read the tag's numbers. Raises ValueError if there are too many, KeyError for an unknown type."""
        letter = _LETTERS[self.kind]
        if self.count > _ITEMS_MAX:
            raise ValueError(f"a tag of {self.count} items")
        form = f"{self.order}{self.count}{letter}"
        return struct.unpack(form, read_exactly(file, self.start, struct.calcsize(form)))

    def text(self, file: BinaryIO) -> str:
        """Read the tag's text."""
        return b"".join(self.items(file)).partition(b"\0")[0].decode("utf-8", "replace")

    def number(self, file: BinaryIO) -> float:
        """Read the tag's first number, also if it is stored as text."""
        return float(self.text(file)) if _LETTERS[self.kind] == "s" else self.items(file)[0]


def tags_at_start(beginning: bytes) -> set[int]:
    """List the first page's tags within the first bytes of a file; empty if it is no TIFF."""
    order = _MARKS.get(beginning[:4])
    if order is None or len(beginning) < 10:
        return set()
    (at,) = struct.unpack_from(f"{order}I", beginning, 4)
    places = range(at + 2, len(beginning) - 11, 12)
    if at + 2 > len(beginning):
        return set()
    (count,) = struct.unpack_from(f"{order}H", beginning, at)
    return {struct.unpack_from(f"{order}H", beginning, place)[0] for place in places[:count]}


def pages(file: BinaryIO) -> list[dict[int, Tag]]:
    """Read each page's tags by number. Raises ValueError, EOFError or KeyError if the file is no TIFF."""
    head = read_exactly(file, 0, 8)
    order = _MARKS[head[:4]]
    (at,) = struct.unpack_from(f"{order}I", head, 4)
    found: list[dict[int, Tag]] = []
    passed = 0
    while at:
        (count,) = struct.unpack(f"{order}H", read_exactly(file, at, 2))
        passed += count + 1
        if passed > _TAGS_MAX:
            raise ValueError(f"more than {_TAGS_MAX} tags")
        data = read_exactly(file, at + 2, 12 * count + 4)
        found.append({})
        for place in range(0, 12 * count, 12):
            number, kind, items, value = struct.unpack_from(f"{order}HHII", data, place)
            size = struct.calcsize(_LETTERS[kind]) * items if kind in _LETTERS else 5
            # A value of at most 4 bytes is stored in the directory.
            found[-1][number] = Tag(order, kind, items, at + 2 + place + 8 if size <= 4 else value)
        (at,) = struct.unpack_from(f"{order}I", data, 12 * count)
    return found


def picture(file: BinaryIO, page: Mapping[int, Tag]) -> tuple[tuple[int, int], list[Block]]:
    """Return the shape (rows, cols) of a page's picture of one value per pixel, and its strips from the top.

    Raises ValueError if it is compressed, or if its strips do not fill its shape."""
    rows, cols, bits = (int(page[tag].number(file)) for tag in (_ROWS, _COLS, _BITS))
    form = int(page[_FORMAT].number(file)) if _FORMAT in page else 1
    if _PACKING in page and page[_PACKING].number(file) != 1:
        raise ValueError("a compressed picture")
    kind = f"{page[_ROWS].order}{_FORMATS[form]}{bits // 8}"
    strips, at = [], 0
    for start, length in zip(page[_STRIPS].items(file), page[_STRIP_BYTES].items(file), strict=True):
        high = length // max(1, cols * (bits // 8))
        strips.append(Block(start, (high, cols), kind).within(file))
        at += high
    if at != rows:
        raise ValueError(f"strips of {at} rows for a picture of {rows}")
    return (rows, cols), strips
