# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of Digital Surf .sur and .pro (MountainsMap): a header of 512 bytes, comments, then integers from the top.

A "DSCOMPRESSED" file holds the integers in zlib streams after a list of their lengths. (Format: Digital Surf, "Surface
file format", version 2.)"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from functools import partial
from typing import BinaryIO

import numpy as np

from ...base.strict import MOST_PACKED
from .scan_file import Block, Channel, ScanReader, StoredMap, decoded, in_base_units, read_exactly, unit_over

_PLAIN, _COMPRESSED = b"DIGITAL SURF", b"DSCOMPRESSED"
_HEADER_BYTES = 512
# Object types of a single surface (2, 5) or a single profile (1, 4).
_SINGLE = (1, 2, 4, 5)
_KINDS = {16: "<i2", 32: "<i4"}
_STREAMS_MAX = 10_000
# Codes of inversion: 1 heights, 2 heights and the x axis, 3 heights and the y axis.
_HEIGHTS_INVERTED, _COLUMNS_TOO, _ROWS_TOO = (1, 2, 3), 2, 3


@dataclass(frozen=True)
class _Integers:
    """The conversion of integers to heights; `missing` marks unmeasured points, None if there are none."""

    scale: float
    missing: int | None
    inversion: int

    def heights(self, stored: np.ndarray) -> np.ndarray:
        values = stored * np.float64(-self.scale if self.inversion in _HEIGHTS_INVERTED else self.scale)
        if self.missing is not None:
            values[stored == self.missing] = np.nan
        if self.inversion == _COLUMNS_TOO:
            return values[:, ::-1]
        return values[::-1] if self.inversion == _ROWS_TOO else values


def _maps(file: BinaryIO) -> list[StoredMap]:
    header = read_exactly(file, 0, _HEADER_BYTES)
    _, objects, _, of_type = struct.unpack_from("<4H", header, 12)
    (special,) = struct.unpack_from("<H", header, 86)
    bits, lowest, _, cols, rows, count = struct.unpack_from("<H4iI", header, 98)
    steps = struct.unpack_from("<3f", header, 120)
    name_z, (unit_x, unit_y, unit_z) = _text(header, 164), (_text(header, at) for at in (180, 196, 212))
    (inversion,) = struct.unpack_from("<H", header, 290)
    comment, private = struct.unpack_from("<2H", header, 334)
    if of_type not in _SINGLE or bits not in _KINDS or rows * cols != count:
        raise ValueError(f"{objects} objects of type {of_type}, {rows} x {cols} of {bits} bits")
    (size_x, base_x), (size_y, base_y), (size_z, base_z) = map(in_base_units, (unit_x, unit_y, unit_z))
    channel = Channel(
        "height" if name_z in ("", "Z") else name_z,
        "",
        unit_over(base_z, base_x if base_x != "m" else base_y),
    )
    # The integer two below the lowest height marks unmeasured points.
    integers = _Integers(steps[2] * size_z, lowest - 2 if special == 1 else None, inversion)
    block = Block(_HEADER_BYTES + comment + private, (rows, cols), _KINDS[bits])
    if header.startswith(_COMPRESSED):
        load = partial(_unpacked, block, _streams(file, block), integers)
    else:
        load = partial(_plain, block.within(file), integers)
    return [StoredMap(channel, block.shape, (steps[1] * size_y, steps[0] * size_x), load)]


def _plain(block: Block, integers: _Integers, file: BinaryIO) -> np.ndarray:
    return integers.heights(block.read(file))


def _streams(file: BinaryIO, block: Block) -> tuple[int, list[tuple[int, int]]]:
    """Return the start of the first stream, and each stream's unpacked and packed bytes.

    Raises ValueError for impossible lengths."""
    (count,) = struct.unpack("<I", read_exactly(file, block.start, 4))
    if not 1 <= count <= _STREAMS_MAX:
        raise ValueError(f"{count} streams")
    numbers = struct.unpack(f"<{2 * count}I", read_exactly(file, block.start + 4, 8 * count))
    lengths = list(zip(numbers[::2], numbers[1::2], strict=True))
    if sum(unpacked for unpacked, _ in lengths) != block.nbytes:
        raise ValueError("the streams hold another number of values than the header declares")
    if any(unpacked > MOST_PACKED * packed + MOST_PACKED for unpacked, packed in lengths):
        raise ValueError("the streams are too short for the values that the header declares")
    return block.start + 4 + 8 * count, lengths


def _unpacked(
    block: Block, streams: tuple[int, list[tuple[int, int]]], integers: _Integers, file: BinaryIO
) -> np.ndarray:
    at, lengths = streams
    data = bytearray()
    for unpacked, packed in lengths:
        piece = zlib.decompressobj().decompress(read_exactly(file, at, packed), unpacked or 1)
        if len(piece) != unpacked:
            raise ValueError(f"a stream holds {len(piece)} of {unpacked} bytes")
        data += piece
        at += packed
    return integers.heights(np.frombuffer(data, block.kind).reshape(block.shape))


def _text(header: bytes, at: int) -> str:
    """Read a text of 16 bytes. MountainsMap writes Latin-1, other programs UTF-8."""
    return decoded(header[at : at + 16].partition(b"\0")[0]).strip()


def _begins(beginning: bytes) -> bool:
    return beginning.startswith((_PLAIN, _COMPRESSED))


DIGITAL_SURF = ScanReader("Digital Surf", (".sur", ".pro"), _begins, _maps)
