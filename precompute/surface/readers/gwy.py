# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of Gwyddion .gwy: SI units, row 0 at the scan's top, masked pixels missing.

A file is a tree of serialised objects (Gwyddion's user guide, "Gwyddion native data files"). An object is its type's
name, its size in bytes, and its components. A component is a name, a letter for the value's type, and the value. The
outermost object is a container with the components "/N/data", "/N/data/title" and "/N/mask": image, title and mask of
channel N. The reader skips all others unread by their sizes, and checks sizes before it reads."""

from __future__ import annotations

import re
import struct
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ...base.failure import GratingError
from ..height_map import HeightMap
from .channels import Channel, choose_channel, shortened, unit_over
from .scan_file import refuse_too_large

_BEGINNING = b"GWYP"
# By type letter: formats of single values, and sizes of one item of an array.
_SCALARS = {b"b": "<?", b"c": "<c", b"i": "<i", b"q": "<q", b"d": "<d"}
_ITEM_BYTES = {b"C": 1, b"I": 4, b"Q": 8, b"D": 8}
_MASKED_ABOVE = 0.5
# The most components and list items of an object. A file of a hundred channels with settings has thousands.
_PARTS_MAX = 100_000
# Names and strings are read in pieces of this many bytes.
_PIECE = 256


class GwyddionReader:
    """Reader of Gwyddion files, see `Reader`."""

    name = "Gwyddion"
    extensions = (".gwy",)
    needs_size = False

    def can_read(self, beginning: bytes) -> bool:
        """As in `Reader`."""
        return beginning.startswith(_BEGINNING)

    def channels(self, source: str) -> tuple[Channel, ...]:
        """As in `Reader`; reads no heights."""
        with open(source, "rb") as file:
            return tuple(image.channel for image in _images(source, file))

    def read(
        self,
        source: str,
        *,
        size_um: float | None = None,
        height_nm: float | None = None,
        channel: str | None = None,
    ) -> HeightMap:
        """As in `Reader`."""
        with open(source, "rb") as file:
            images = _images(source, file)
            channels = tuple(image.channel for image in images)
            image = images[choose_channel(source, channels, channel)]
            refuse_too_large(source, image.field.shape)
            height = image.heights(file)
        (rows, cols), (height_m, width_m) = image.field.shape, image.field.size_m
        return HeightMap(
            height_m=height,
            pixel_size_m=(height_m / rows, width_m / cols),
            source=source,
            channel=image.channel.label,
            channels=tuple(each.label for each in channels),
        )


GWYDDION = GwyddionReader()


@dataclass(frozen=True)
class _Value:
    """The location of a component's value: its type letter, its first byte and the byte after its last."""

    kind: bytes
    start: int
    stop: int


@dataclass(frozen=True)
class _Field:
    """A map of values: shape (rows, cols), sides (Ly, Lx), location of the values, and their unit by `unit_over`."""

    shape: tuple[int, int]
    size_m: tuple[float, float]
    values: _Value
    unit: str

    def read(self, file: BinaryIO) -> np.ndarray:
        """Read the values (rows, cols), float64."""
        file.seek(self.values.start + 4)
        return np.fromfile(file, "<f8", self.shape[0] * self.shape[1]).reshape(self.shape)


@dataclass(frozen=True)
class _Image:
    """A channel, its field, and its mask's field if it has one."""

    channel: Channel
    field: _Field
    mask: _Field | None

    def heights(self, file: BinaryIO) -> np.ndarray:
        """Read the values (rows, cols), NaN if masked."""
        heights = self.field.read(file)
        if self.mask is not None:
            heights[self.mask.read(file) > _MASKED_ABOVE] = np.nan
        return heights


def _images(source: str, file: BinaryIO) -> list[_Image]:
    """List the images of a file by channel number. Raises GratingError if the file is damaged."""
    try:
        kind, parts = _object(file, len(_BEGINNING), Path(source).stat().st_size)
        if kind != "GwyContainer":
            raise ValueError("not a Gwyddion container")
        numbers = sorted((key.split("/")[1] for key in parts if re.fullmatch(r"/\d{1,9}/data", key)), key=int)
        fields = {number: field for number in numbers if (field := _field(file, parts[f"/{number}/data"])) is not None}
        titles = {number: _title(file, parts, number) for number in fields}
        shared = Counter(titles.values())
        return [
            _Image(
                # Numbers distinguish channels of the same title.
                Channel(titles[number], f"({number})" if shared[titles[number]] > 1 else "", field.unit),
                field,
                _mask(file, parts, number, field.shape),
            )
            for number, field in fields.items()
        ]
    except (KeyError, ValueError, struct.error) as error:
        raise GratingError(
            source,
            f"the Gwyddion data is truncated or damaged ({shortened(error)})",
            "copy it again, or save it again in Gwyddion",
        ) from error


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
    size_m = float(_number(file, parts["yreal"])), float(_number(file, parts["xreal"]))
    across, up = (_unit(file, parts.get(f"si_unit_{each}")) for each in ("xy", "z"))
    return _Field((int(rows), int(cols)), size_m, values, unit_over(up, across))


def _unit(file: BinaryIO, value: _Value | None) -> str:
    """Read a unit's text; "" for none."""
    if value is None or value.kind != b"o":
        return ""
    _, parts = _object(file, value.start, value.stop)
    return _text(file, parts["unitstr"]) if "unitstr" in parts else ""


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
        raise ValueError("a title or unit is no text")
    file.seek(value.start)
    return file.read(min(_PIECE, value.stop - value.start)).rstrip(b"\0").decode("utf-8", "replace")


def _number(file: BinaryIO, value: _Value) -> float:
    if value.kind not in (b"i", b"q", b"d"):
        raise ValueError("a size is no number")
    file.seek(value.start)
    return struct.unpack(_SCALARS[value.kind], file.read(value.stop - value.start))[0]


def _count(file: BinaryIO, at: int) -> int:
    file.seek(at)
    return struct.unpack("<I", file.read(4))[0]
