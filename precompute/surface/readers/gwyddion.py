# SPDX-License-Identifier: GPL-3.0-or-later
"""Readers of Gwyddion's files: .gwy, Simple Field .gsf and text exports, all with row 0 at the scan's top.

A .gwy file is a tree of serialised objects (Gwyddion's user guide, "Gwyddion native data files"). An object is its
type's name, its size in bytes, and its components. A component is a name, a letter for the value's type, and the value.
The outermost object is a container with the components "/N/data", "/N/data/title" and "/N/mask": image, title and mask
of channel N. The reader skips all others unread by their sizes, and checks sizes before it reads. Masked pixels are
missing.

A .gsf file has lines "KEY = VALUE", one to four zero bytes, then 32-bit floats. (Format: Gwyddion's user guide,
"Gwyddion Simple Field".)

A text export has comments with title, width, height and unit, then the heights. The reader goes by the order of the
comments, since their names are translated. Numbers may have decimal commas. (Format: Gwyddion's user guide, "Raw data
and text file export".)"""

from __future__ import annotations

import os
import re
import struct
from collections import Counter
from dataclasses import dataclass
from functools import partial
from typing import BinaryIO

import numpy as np

from .scan_file import (
    Block,
    Channel,
    ScanReader,
    StoredMap,
    decoded,
    in_base_units,
    in_metres,
    unit_over,
)
from .text_tables import read_text, rows_of

_BEGINNING = b"GWYP"
# By type letter: formats of single values, and sizes of one item of an array.
_SCALARS = {b"b": "<?", b"c": "<c", b"i": "<i", b"q": "<q", b"d": "<d"}
_ITEM_BYTES = {b"C": 1, b"I": 4, b"Q": 8, b"D": 8}
_MASKED_ABOVE = 0.5
# The most components and list items of an object. A file of a hundred channels with settings has thousands.
_PARTS_MAX = 100_000
# Names and strings are read in pieces of this many bytes.
_PIECE = 256


@dataclass(frozen=True)
class _Value:
    """The location of a component's value: its type letter, its first byte and the byte after its last."""

    kind: bytes
    start: int
    stop: int


@dataclass(frozen=True)
class _Field:
    """A map of values: shape (rows, cols), pixels (dy, dx), location of the values, the size of their unit in base
    units, and the base unit by `unit_over`."""

    shape: tuple[int, int]
    pixel_size_m: tuple[float, float]
    values: _Value
    scale: float
    unit: str

    def read(self, file: BinaryIO) -> np.ndarray:
        """Read the values (rows, cols), float64 in base units."""
        values = Block(self.values.start + 4, self.shape, "<f8").read(file)
        return values if self.scale == 1 else values * self.scale


def _gwy_maps(file: BinaryIO) -> list[StoredMap]:
    """List the images by channel number."""
    kind, parts = _object(file, len(_BEGINNING), file.seek(0, os.SEEK_END))
    if kind != "GwyContainer":
        raise ValueError("not a Gwyddion container")
    numbers = sorted((key.split("/")[1] for key in parts if re.fullmatch(r"/\d{1,9}/data", key)), key=int)
    fields = {number: field for number in numbers if (field := _field(file, parts[f"/{number}/data"])) is not None}
    titles = {number: _title(file, parts, number) for number in fields}
    shared = Counter(titles.values())
    return [
        StoredMap(
            # Numbers distinguish channels of the same title.
            Channel(titles[number], f"({number})" if shared[titles[number]] > 1 else "", field.unit),
            field.shape,
            field.pixel_size_m,
            partial(_gwy_heights, field, _mask(file, parts, number, field.shape)),
        )
        for number, field in fields.items()
    ]


def _gwy_heights(field: _Field, mask: _Field | None, file: BinaryIO) -> np.ndarray:
    """Read a field's values (rows, cols), NaN if masked."""
    heights = field.read(file)
    if mask is not None:
        heights[mask.read(file) > _MASKED_ABOVE] = np.nan
    return heights


def _title(file: BinaryIO, parts: dict[str, _Value], number: str) -> str:
    title = parts.get(f"/{number}/data/title")
    return f"channel {number}" if title is None else _text(file, title)


def _mask(file: BinaryIO, parts: dict[str, _Value], number: str, shape: tuple[int, int]) -> _Field | None:
    """Return a channel's mask or None. Raises ValueError if its shape differs from the channel's."""
    if f"/{number}/mask" not in parts:
        return None
    mask = _field(file, parts[f"/{number}/mask"])
    if mask is None or mask.shape != shape:
        raise ValueError(f"the mask of channel {number} is not of the channel's shape")
    return mask


def _field(file: BinaryIO, value: _Value) -> _Field | None:
    """Return the field that a value holds; None for other values. Raises KeyError or ValueError if it is damaged."""
    if value.kind != b"o":
        return None
    kind, parts = _object(file, value.start, value.stop)
    if kind != "GwyDataField":
        return None
    rows, cols, values = _number(file, parts["yres"]), _number(file, parts["xres"]), parts["data"]
    held = (values.stop - values.start - 4) // _ITEM_BYTES[b"D"]
    if values.kind != b"D" or rows < 1 or cols < 1 or rows * cols != held:
        raise ValueError(f"a channel is {rows} x {cols} with {held} values")
    height, width = (_number(file, parts[key]) for key in ("yreal", "xreal"))
    (across, base), (scale, unit) = (_unit(file, parts.get(f"si_unit_{each}")) for each in ("xy", "z"))
    pixel_size_m = height * across / rows, width * across / cols
    return _Field((int(rows), int(cols)), pixel_size_m, values, scale, unit_over(unit, base))


def _unit(file: BinaryIO, value: _Value | None) -> tuple[float, str]:
    """Read a unit as `in_base_units` does. Gwyddion writes base units, other programs also "um"."""
    if value is None or value.kind != b"o":
        return 1.0, ""
    _, parts = _object(file, value.start, value.stop)
    return in_base_units(_text(file, parts["unitstr"])) if "unitstr" in parts else (1.0, "")


def _object(file: BinaryIO, start: int, end: int) -> tuple[str, dict[str, _Value]]:
    """Return the type of the object at `start`, and its components' values.

    Raises ValueError or struct.error if the object is damaged or ends after `end`."""
    at = _string_end(file, start, end)
    kind = _text(file, _Value(b"s", start, at))
    stop = at + 4 + _count(file, at)
    if stop > end:
        raise ValueError(f"{stop - end} bytes are missing")
    parts: dict[str, _Value] = {}
    passed = 0
    at += 4
    while at < stop:
        name_end = _string_end(file, at, stop)
        name = _text(file, _Value(b"s", at, name_end))
        file.seek(name_end)
        letter = file.read(1)
        value_end, items = _value_end(file, letter, name_end + 1, stop)
        passed += items
        if passed > _PARTS_MAX:
            raise ValueError(f"more than {_PARTS_MAX} components")
        parts[name] = _Value(letter, name_end + 1, value_end)
        at = value_end
    return kind, parts


def _value_end(file: BinaryIO, letter: bytes, at: int, end: int) -> tuple[int, int]:
    """Return the position after the value at `at`, and its number of items, without opening nested objects.

    Raises as _object does."""
    items = 1
    if letter in _SCALARS:
        at += struct.calcsize(_SCALARS[letter])
    elif letter in _ITEM_BYTES:
        at += 4 + _ITEM_BYTES[letter] * _count(file, at)
    elif letter in (b"s", b"o"):
        at = _item_end(file, letter, at, end)
    elif letter in (b"S", b"O"):
        items, at = _count(file, at), at + 4
        for _ in range(min(items, _PARTS_MAX)):
            at = _item_end(file, letter.lower(), at, end)
    else:
        raise ValueError(f"unknown component type {letter!r}")
    if at > end:
        raise ValueError(f"{at - end} bytes are missing")
    return at, items


def _item_end(file: BinaryIO, letter: bytes, at: int, end: int) -> int:
    """Return the position after a string or an object."""
    at = _string_end(file, at, end)
    return at if letter == b"s" else at + 4 + _count(file, at)


def _string_end(file: BinaryIO, at: int, end: int) -> int:
    """Return the position after the string at `at` and its zero byte."""
    file.seek(at)
    while at < end and (piece := file.read(min(_PIECE, end - at))):
        zero = piece.find(b"\0")
        if zero >= 0:
            return at + zero + 1
        at += len(piece)
    raise ValueError("a name has no end")


def _text(file: BinaryIO, value: _Value) -> str:
    """Read at most _PIECE bytes of a string; no name, title or unit that matters is longer."""
    if value.kind not in (b"s", b"c"):  # the package gwyfile writes a text of one letter as a character
        raise ValueError("a title or unit is not a text")
    file.seek(value.start)
    return file.read(min(_PIECE, value.stop - value.start)).rstrip(b"\0").decode("utf-8", "replace")


def _number(file: BinaryIO, value: _Value) -> float:
    if value.kind not in (b"i", b"q", b"d"):
        raise ValueError("a size is not a number")
    file.seek(value.start)
    return struct.unpack(_SCALARS[value.kind], file.read(value.stop - value.start))[0]


def _count(file: BinaryIO, at: int) -> int:
    file.seek(at)
    return struct.unpack("<I", file.read(4))[0]


def _begins_gwy(beginning: bytes) -> bool:
    return beginning.startswith(_BEGINNING)


GWYDDION = ScanReader("Gwyddion", (".gwy",), _begins_gwy, _gwy_maps)


_GSF_BEGINNING = b"Gwyddion Simple Field 1."
_HEADER_MAX = 1 << 16


def _gsf_maps(file: BinaryIO) -> list[StoredMap]:
    file.seek(0)
    header, zero, _ = file.read(_HEADER_MAX).partition(b"\0")
    if not zero:
        raise ValueError("the header has no end")
    pairs = (line.partition("=") for line in decoded(header).splitlines()[1:])
    entries = {key.strip(): value.strip() for key, _, value in pairs}
    shape = int(entries["YRes"]), int(entries["XRes"])
    across, base = in_base_units(entries.get("XYUnits", ""))
    size, unit = in_base_units(entries.get("ZUnits", ""))
    # At least one zero pads the header to a multiple of 4 bytes.
    block = Block(len(header) + 4 - len(header) % 4, shape, "<f4").within(file)
    sides = (float(entries.get(key, "1")) * across for key in ("YReal", "XReal"))
    height, width = sides
    channel = Channel(entries.get("Title") or "height", "", unit_over(unit, base))
    return [StoredMap(channel, shape, (height / shape[0], width / shape[1]), partial(_values, block, size))]


def _values(block: Block, scale: float, file: BinaryIO) -> np.ndarray:
    return block.scaled(file, scale=scale)


def _begins_gsf(beginning: bytes) -> bool:
    return beginning.startswith(_GSF_BEGINNING)


GSF = ScanReader("Gwyddion Simple Field", (".gsf",), _begins_gsf, _gsf_maps)


def _facts(text: str) -> list[str]:
    """Return the values after the colons of the comments at a text's beginning."""
    facts = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        name, colon, value = line[1:].partition(":")
        if colon and name.strip():
            facts.append(value.strip())
    return facts


def _maps(file: BinaryIO) -> list[StoredMap]:
    text = read_text(file)
    *title, width, height, unit = _facts(text)
    values = rows_of(text)
    size, base = in_base_units(unit)
    pixel = in_metres(height) / values.shape[0], in_metres(width) / values.shape[1]
    channel = Channel(title[0] if title and title[0] else "height", "", base)
    return [StoredMap(channel, values.shape, pixel, partial(_heights, values, size))]


def _heights(values: np.ndarray, unit: float, file: BinaryIO) -> np.ndarray:
    return values * unit


def _begins(beginning: bytes) -> bool:
    if not beginning.startswith(b"#"):
        return False
    try:
        *_, width, height, unit = _facts(decoded(beginning))
        return in_metres(width) > 0 and in_metres(height) > 0 and bool(unit)
    except ValueError:
        return False


GWYDDION_TEXT = ScanReader("Gwyddion text", (".txt",), _begins, _maps)
