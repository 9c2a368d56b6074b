# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of Park Systems .tiff: a TIFF with a coloured picture, and the values and their header in private tags.

A value is gain times (integer times scale plus offset). Lines run from the scan's bottom up; if its axes are swapped,
from left to right. (Format: Park Systems, "Park TIFF file format"; swapped axes: Gwyddion's module psia.)"""

from __future__ import annotations

import struct
from functools import partial
from typing import BinaryIO

import numpy as np

from .channels import Channel
from .scan_file import Block, ScanReader, StoredMap, read_exactly
from .tiff_file import pages, tags_at_start
from .units import in_base_units

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
