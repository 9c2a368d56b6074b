# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of OpenEXR .exr heights: one channel or grey RGB, in scan lines, uncompressed or ZIP.

(Format: "OpenEXR File Layout", openexr.com.)"""

from __future__ import annotations

import math
import os
import struct
from typing import BinaryIO

import numpy as np

from ...base.exr import attributes, unpacked
from .numbers_file import Judge, Numbers, NumbersReader
from .scan_file import read_exactly

_MAGIC, _SCAN_LINES_OF_VERSION_2 = b"v/1\x01", b"\2\0\0\0"
_KINDS = {0: "<u4", 1: "<f2", 2: "<f4"}
# Rows per block by compression: none, ZIP of one row, ZIP of 16 rows.
_ROWS_IN_BLOCK = {0: 1, 2: 1, 3: 16}
_HEAD_MAX = 1 << 20
# Deflate packs at most this many bytes into one.
_MOST_PACKED = 1032
# Names of a height channel among others, in order of preference.
_HEIGHTS = ("Y", "Z", "height", "Height", "V")


def _channels(value: bytes) -> list[tuple[str, str]]:
    """Read the channels' names and types in file order. Raises ValueError for a subsampled channel."""
    found, at = [], 0
    while value[at : at + 1] != b"\0":
        end = value.index(b"\0", at)
        kind, _, step_x, step_y = struct.unpack_from("<4i", value, end + 1)
        if (step_x, step_y) != (1, 1):
            raise ValueError("a channel of fewer pixels")
        found.append((value[at:end].decode("ascii"), _KINDS[kind]))
        at = end + 17
    return found


def _load(file: BinaryIO, judge: Judge) -> Numbers:
    file.seek(0)
    head = file.read(_HEAD_MAX)
    if head[4:8] != _SCAN_LINES_OF_VERSION_2:
        raise ValueError("tiles or several parts; save it as scan lines")
    facts, table_at = attributes(head)
    left, top, right, bottom = struct.unpack("<4i", facts["dataWindow"][1])
    cols, rows = right - left + 1, bottom - top + 1
    packing = facts["compression"][1][0]
    if packing not in _ROWS_IN_BLOCK:
        raise ValueError("a packing other than ZIP; save it with ZIP or none")
    channels = _channels(facts["channels"][1])
    row_bytes = cols * sum(np.dtype(kind).itemsize for _, kind in channels)
    held = file.seek(0, os.SEEK_END)
    if min(rows, cols, row_bytes) < 1 or rows * row_bytes > _MOST_PACKED * held:
        raise ValueError(f"{rows} x {cols} pixels declared, and {held} bytes are there")
    wanted = _wanted([name for name, _ in channels])
    judge((rows, cols))
    heights = np.empty((rows, cols))
    high = _ROWS_IN_BLOCK[packing]
    places = struct.unpack(f"<{-(-rows // high)}Q", read_exactly(file, table_at, 8 * math.ceil(rows / high)))
    for place in places:
        row, size = struct.unpack("<2i", read_exactly(file, place, 8))
        first = row - top
        count = min(high, rows - first)
        if first < 0 or first % high or count < 1 or not 0 < size <= count * row_bytes:
            raise ValueError(f"a block of {size} bytes at row {first}")
        block = unpacked(read_exactly(file, place + 8, size), count * row_bytes).reshape(count, row_bytes)
        heights[first : first + count] = _grey(block, channels, wanted, cols=cols)
    (width_over_height,) = struct.unpack("<f", facts["pixelAspectRatio"][1])
    return Numbers(heights, 1 / width_over_height)


def _wanted(names: list[str]) -> list[str]:
    """Choose the channels that hold the heights. Raises ValueError if there are none."""
    if len(names) == 1:
        return names
    single = next((name for name in _HEIGHTS if name in names), None)
    if single is None and not {"R", "G", "B"} <= set(names):
        raise ValueError(f"channels {', '.join(names)}; save the heights as the channel Y")
    return [single] if single else ["R", "G", "B"]


def _grey(block: np.ndarray, channels: list[tuple[str, str]], wanted: list[str], *, cols: int) -> np.ndarray:
    """Extract the heights of a block's rows. Raises ValueError if it is coloured."""
    found, at = {}, 0
    for name, kind in channels:
        size = cols * np.dtype(kind).itemsize
        found[name] = block[:, at : at + size].copy().view(kind)
        at += size
    first, *others = (found[name] for name in wanted)
    if not all(np.array_equal(first, other, equal_nan=True) for other in others):
        raise ValueError("it is coloured, and a colour is no height; save the heights in grey")
    return first


def _begins(beginning: bytes) -> bool:
    return beginning.startswith(_MAGIC)


EXR = NumbersReader("OpenEXR", (".exr",), _begins, _load)
