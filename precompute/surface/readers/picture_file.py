# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures the data that a picture file holds beside its pixels, before Pillow opens the file.

Pillow reads all texts, profiles and tags into memory, with the length that the file declares, and walks through all
pages of a TIFF. So a small or sparse file can cost gigabytes or minutes. This module reads only lengths.

Formats: PNG (Third Edition), section 5; TIFF 6.0, section 2, and BigTIFF; BITMAPINFOHEADER of BMP."""

from __future__ import annotations

import os
import struct
from dataclasses import dataclass
from typing import BinaryIO

# The most bytes beside the picture; no scan needs more. Counting stops beyond it.
BESIDE_MAX = 4 << 20
# A decoder's least memory per chunk or tag.
_EACH_BYTES = 64
# Bytes of a value by TIFF type; other types are skipped.
_TIFF_TYPE_BYTES = {
    1: 1,
    2: 1,
    3: 2,
    4: 4,
    5: 8,
    6: 1,
    7: 1,
    8: 2,
    9: 4,
    10: 8,
    11: 4,
    12: 8,
    13: 4,
    16: 8,
    17: 8,
    18: 8,
}
# Tags that point to further directories, which Pillow reads too: Exif, GPS and interoperability.
_TIFF_FURTHER = (34665, 34853, 40965)


@dataclass(frozen=True)
class Beside:
    """The data beside the pixels: the bytes that a decoder would read, and whether there are several pictures."""

    held_bytes: int
    several: bool = False


def beside_png(file: BinaryIO) -> Beside:
    """Add the lengths of all chunks except the picture's."""
    size = file.seek(0, os.SEEK_END)
    at, held, several = 8, 0, False
    while at + 8 <= size and held <= BESIDE_MAX:
        file.seek(at)
        length, kind = struct.unpack(">I4s", file.read(8))
        held += _EACH_BYTES + (0 if kind == b"IDAT" else length)
        if kind == b"acTL":  # an animation; its first number is the number of pictures
            several = several or file.read(4) not in (b"\0\0\0\0", b"\0\0\0\1")
        if kind == b"IEND":
            break
        at += length + 12
    return Beside(held, several)


def beside_tiff(file: BinaryIO) -> Beside:
    """Add the lengths of all values of the first directory and its subdirectories; look for another page."""
    file.seek(0)
    beginning = file.read(16)
    order = "<" if beginning.startswith(b"II") else ">"
    big = b"+" in beginning[2:4]
    first = struct.unpack_from(f"{order}Q", beginning, 8) if big else struct.unpack_from(f"{order}I", beginning, 4)
    held, further, after = _directory(file, first[0], order, big=big)
    for start in further:
        held += _directory(file, start, order, big=big)[0]
    return Beside(held, after != 0)


def beside_bmp(file: BinaryIO) -> Beside:
    """Read the length of the header."""
    file.seek(14)
    return Beside(struct.unpack("<I", file.read(4))[0])


def _directory(file: BinaryIO, start: int, order: str, *, big: bool) -> tuple[int, list[int], int]:
    """Return the bytes of a directory's values, the starts of its subdirectories, and the start of the next page or 0.

    `order` is the byte order, `big` marks BigTIFF. Raises struct.error if the file ends too soon."""
    counter, entry, offset = (f"{order}Q", f"{order}HHQQ", f"{order}Q") if big else (
        f"{order}H", f"{order}HHII", f"{order}I"
    )  # fmt: skip
    file.seek(start)
    (count,) = struct.unpack(counter, file.read(struct.calcsize(counter)))
    held = 0
    further: list[int] = []
    for _ in range(min(count, 1 << 16)):
        tag, kind, items, value = struct.unpack(entry, file.read(struct.calcsize(entry)))
        held += _EACH_BYTES + _TIFF_TYPE_BYTES.get(kind, 0) * items
        if held > BESIDE_MAX:
            return held, further, 0
        if tag in _TIFF_FURTHER:
            further.append(value)
    (after,) = struct.unpack(offset, file.read(struct.calcsize(offset)))
    return held, further, after
