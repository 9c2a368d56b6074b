# SPDX-License-Identifier: GPL-3.0-or-later
"""Readers of instruments' TIFF files, which keep maps in private tags or several pages: JPK and Park Systems.

Only requested tags are read. (Format: TIFF 6.0, section 2.)

JPK .jpk and .jpk-qi-image have a page with a thumbnail and the scan's size, then a page for each channel. A channel has
slots, which scale its integers to volts, nominal or calibrated heights. The reader uses the default slot. Lines run
from the scan's bottom up, unless it is reflected. (Format: JPK Instruments, "JPK image file specification".)

Park Systems .tiff has a coloured picture, and the values and their header in private tags. A value is gain times
(integer times scale plus offset). Lines run from the scan's bottom up; if its axes are swapped, from left to right.
(Format: Park Systems, "Park TIFF file format"; swapped axes: Gwyddion's module psia.)"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, BinaryIO

import numpy as np

from .scan_file import Block, Channel, ScanReader, StoredMap, in_base_units, read_exactly

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


_JPK_VERSION, _WIDTH, _HEIGHT, _REFLECTED = 32768, 32834, 32835, 32837
_NAME, _IS_RETRACE, _FANCY_NAME, _SLOTS, _DEFAULT = 32848, 32849, 32850, 32896, 32897
# The first slot's first tag, the step between slots, and the offsets in a slot: unit, scaling type, factor, offset.
_SLOT, _SLOT_STEP, _UNIT, _SCALING, _FACTOR, _OFFSET = 32912, 48, 18, 19, 20, 21
_SLOTS_MAX = 100


def _jpk_maps(file: BinaryIO) -> list[StoredMap]:
    first, *channels = pages(file)
    height, width = (first[tag].number(file) for tag in (_HEIGHT, _WIDTH))
    return [_map(file, page, (height, width)) for page in channels if _NAME in page]


def _map(file: BinaryIO, page: dict[int, Tag], sides: tuple[float, float]) -> StoredMap:
    reflected = _REFLECTED in page and page[_REFLECTED].number(file) != 0
    shape, strips = picture(file, page)
    unit, factor, offset = _scaling(file, page)
    size, base = in_base_units(unit)
    name = page[_FANCY_NAME if _FANCY_NAME in page else _NAME].text(file)
    is_retrace = _IS_RETRACE in page and page[_IS_RETRACE].number(file) != 0
    return StoredMap(
        Channel(name, "retrace" if is_retrace else "trace", base),
        shape,
        (sides[0] / shape[0], sides[1] / shape[1]),
        partial(_jpk_values, strips, factor * size, offset * size, reflected),
    )


def _scaling(file: BinaryIO, page: dict[int, Tag]) -> tuple[str, float, float]:
    """Read unit, factor and offset of the default slot; without one, a unit that makes only this channel unusable."""
    wanted = page[_DEFAULT].text(file)
    for slot in range(min(int(page[_SLOTS].number(file)), _SLOTS_MAX)):
        at = _SLOT + slot * _SLOT_STEP
        if page[at].text(file) == wanted:
            if page[at + _SCALING].text(file) != "LinearScaling":
                return "", 1.0, 0.0
            unit, factor, offset = page[at + _UNIT], page[at + _FACTOR], page[at + _OFFSET]
            return unit.text(file), factor.number(file), offset.number(file)
    return "an unknown unit", 1.0, 0.0


def _jpk_values(strips: list[Block], factor: float, offset: float, reflected: bool, file: BinaryIO) -> np.ndarray:
    values = np.concatenate([strip.read(file) for strip in strips]) * np.float64(factor)
    values += offset
    return values if reflected else values[::-1]


def _begins_jpk(beginning: bytes) -> bool:
    return _JPK_VERSION in tags_at_start(beginning)


JPK = ScanReader("JPK", (".jpk", ".jpk-qi-image"), _begins_jpk, _jpk_maps)


_VERSION, _DATA, _HEADER = 50433, 50434, 50435
# The length of the header by its version. The second version adds the number type, at _KIND_AT.
_HEADER_BYTES = {0x01000001: 284, 0x01000002: 352}
_KIND_AT = 348
_KINDS = {0: "<i2", 1: "<i4", 2: "<f4"}


def _maps(file: BinaryIO) -> list[StoredMap]:
    page, *others = pages(file)
    if others:
        raise ValueError("several pages")
    needed = _HEADER_BYTES[int(page[_VERSION].number(file))]
    header = read_exactly(file, page[_HEADER].start, needed)
    cols, rows = struct.unpack_from("<2I", header, 100)
    forward, _, swapped = struct.unpack_from("<3I", header, 128)
    width, height = struct.unpack_from("<2d", header, 140)
    gain, scale, offset = struct.unpack_from("<3d", header, 220)
    # The first version holds 16-bit integers.
    kind = _KINDS[struct.unpack_from("<I", header, _KIND_AT)[0] if needed > _KIND_AT else 0]
    size, base = in_base_units(_text(header, 244, 8) or "um")
    if page[_DATA].count < rows * cols * np.dtype(kind).itemsize:
        raise ValueError(f"{rows} x {cols} values declared, and {page[_DATA].count} bytes are there")
    block = Block(page[_DATA].start, (rows, cols), kind).within(file)
    channel = Channel(_text(header, 4, 32), "forward" if forward else "backward", base)
    shape, pixel = block.shape, (height * 1e-6 / rows, width * 1e-6 / cols)
    if swapped:
        shape, pixel = (cols, rows), (pixel[1], pixel[0])
    load = partial(_values, block, gain * (scale or 1.0) * size, gain * offset * size, bool(swapped))
    return [StoredMap(channel, shape, pixel, load)]


def _values(block: Block, factor: float, offset: float, swapped: bool, file: BinaryIO) -> np.ndarray:
    values = block.scaled(file, scale=factor, offset=offset)[::-1]
    return np.rot90(values) if swapped else values


def _text(header: bytes, at: int, characters: int) -> str:
    return header[at : at + 2 * characters].decode("utf-16-le", "replace").partition("\0")[0].strip()


def _begins(beginning: bytes) -> bool:
    return {_DATA, _HEADER} <= tags_at_start(beginning)


PARK = ScanReader("Park", (".tiff", ".tif"), _begins, _maps)
