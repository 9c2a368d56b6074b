# SPDX-License-Identifier: GPL-3.0-or-later
"""Gwyddion .gwy, decoded by gwyfile: SI units, row 0 at the top of the scan, masked pixels missing.

A file is a tree of serialised objects. An object is the name of its type, its size in bytes, and its components; a
component is a name, a letter for the type of its value, and the value.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from ...base.failure import GratingError
from ..height_map import HeightMap
from .channels import Channel, choose_channel

if TYPE_CHECKING:
    from gwyfile.objects import GwyContainer, GwyDataField, GwyObject

_BEGINNING = b"GWYP"
# Sizes of values by the letter of their type: of a single value, and of one item of an array.
_SCALAR_BYTES = {b"b": 1, b"c": 1, b"i": 4, b"q": 8, b"d": 8}
_ITEM_BYTES = {b"C": 1, b"I": 4, b"Q": 8, b"D": 8}
_MASKED_ABOVE = 0.5
# The exceptions that the code below and gwyfile raise where a container is not as Gwyddion writes it.
_DAMAGE = (struct.error, ValueError, KeyError, TypeError, AttributeError, NotImplementedError, RecursionError)

T = TypeVar("T")


class GwyddionReader:
    """Reader of Gwyddion files, see `Reader`."""

    name = "Gwyddion"
    extensions = (".gwy",)
    needs_size = False

    def can_read(self, beginning: bytes) -> bool:
        """As in `Reader`."""
        return beginning.startswith(_BEGINNING)

    def channels(self, source: str) -> tuple[Channel, ...]:
        """As in `Reader`; the format has no table of contents, so that the whole file is read."""
        return _decode(source, lambda container: _channels(container, _fields(container)))

    def read(
        self,
        source: str,
        *,
        size_um: float | None = None,
        height_nm: float | None = None,
        channel: str | None = None,
    ) -> HeightMap:
        """As in `Reader`."""
        return _decode(source, lambda container: _height_map(source, container, channel))


GWYDDION = GwyddionReader()


def _decode(source: str, use: Callable[[GwyObject], T]) -> T:
    """Call `use` with the file's outermost object and return its result. Raises GratingError where the file is
    damaged."""
    from gwyfile.objects import GwyObject

    data = Path(source).read_bytes()
    try:
        # gwyfile trusts the sizes it reads, and never returns from a string without an end: check them before.
        _object_end(data, len(_BEGINNING), len(data))
        return use(GwyObject.frombuffer(data[len(_BEGINNING) :]))
    except _DAMAGE as error:
        raise GratingError(
            f"{source}: the Gwyddion data is truncated or damaged ({error}); "
            "copy it again, or save it again in Gwyddion"
        ) from error


def _height_map(source: str, container: GwyObject, channel: str | None) -> HeightMap:
    fields = _fields(container)
    channels = _channels(container, fields)
    chosen = choose_channel(source, channels, channel)
    number, field = list(fields.items())[chosen]
    height = field.data
    if f"/{number}/mask" in container:
        height = np.where(container[f"/{number}/mask"].data > _MASKED_ABOVE, np.nan, height)
    rows, cols = height.shape
    return HeightMap(
        height_m=height,
        pixel_size_m=(field.yreal / rows, field.xreal / cols),
        source=source,
        channel=channels[chosen].label,
        channels=tuple(each.label for each in channels),
    )


def _fields(container: GwyObject) -> dict[int, GwyDataField]:
    """The container's images by channel number. Raises ValueError or KeyError where an image is not whole."""
    from gwyfile.objects import GwyContainer, GwyDataField

    if not isinstance(container, GwyContainer):
        raise ValueError("not a Gwyddion container")
    numbered = {
        int(key.split("/")[1]): value
        for key, value in container.items()
        if re.fullmatch(r"/\d+/data", key) and isinstance(value, GwyDataField)
    }
    for number, field in numbered.items():
        rows, cols = field["yres"], field["xres"]
        if rows < 1 or cols < 1 or rows * cols != np.size(field["data"]):
            raise ValueError(f"channel {number} is {rows} x {cols} with {np.size(field['data'])} values")
        field["xreal"], field["yreal"] = float(field["xreal"]), float(field["yreal"])
    return dict(sorted(numbered.items()))


def _channels(container: GwyContainer, fields: dict[int, GwyDataField]) -> tuple[Channel, ...]:
    titles = [container.get(f"/{number}/data/title", f"channel {number}") for number in fields]
    return tuple(
        # Where two channels have the same title, their numbers tell them apart.
        Channel(title, f"({number})" if titles.count(title) > 1 else "", _unit(field))
        for title, (number, field) in zip(titles, fields.items(), strict=True)
    )


def _unit(field: GwyDataField) -> str:
    """The unit of the values; "m over X" where the sides of the field are not in metres."""
    across, up = (unit.get("unitstr", "") if unit else "" for unit in (field.si_unit_xy, field.si_unit_z))
    return up if across == "m" else f"{up} over {across}"


def _object_end(data: bytes, at: int, end: int) -> int:
    """Offset of the first byte after the object at `at`.

    Raises ValueError or struct.error where the object does not end before `end`."""
    at = _string_end(data, at, end)
    stop = at + 4 + _count(data, at)
    if stop > end:
        raise ValueError(f"{stop - end} bytes are missing")
    at += 4
    while at < stop:
        at = _component_end(data, at, stop)
    return stop


def _component_end(data: bytes, at: int, end: int) -> int:
    """Offset of the first byte after the component at `at`. Raises as _object_end does."""
    at = _string_end(data, at, end)
    kind, at = data[at : at + 1], at + 1
    if kind in _SCALAR_BYTES:
        at += _SCALAR_BYTES[kind]
    elif kind in _ITEM_BYTES:
        at += 4 + _ITEM_BYTES[kind] * _count(data, at)
    elif kind == b"o":
        at = _object_end(data, at, end)
    elif kind == b"s":
        at = _string_end(data, at, end)
    elif kind in (b"O", b"S"):
        skip = _object_end if kind == b"O" else _string_end
        count, at = _count(data, at), at + 4
        for _ in range(count):
            at = skip(data, at, end)
    else:
        raise ValueError(f"unknown component type {kind!r}")
    if at > end:
        raise ValueError(f"{at - end} bytes are missing")
    return at


def _string_end(data: bytes, at: int, end: int) -> int:
    zero = data.find(b"\0", at, end)
    if zero < 0:
        raise ValueError("a name has no end")
    return zero + 1


def _count(data: bytes, at: int) -> int:
    return struct.unpack_from("<I", data, at)[0]
