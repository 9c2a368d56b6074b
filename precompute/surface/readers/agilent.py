# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of Agilent and Molecular Imaging .mi: lines of a 14-character key and a value, then channels of integers.

The line "data" ends the header. The integer range covers the channel's "bufferRange" to both sides of zero. Lines run
from the scan's bottom up."""

from __future__ import annotations

import re
from functools import partial
from typing import BinaryIO

import numpy as np

from .scan_file import Block, Channel, ScanReader, StoredMap, decoded, in_base_units

_BEGINNING = re.compile(rb"fileType {6}\S")
_KEY_WIDTH = 14
_DATA = re.compile(rb"^data {10}(\w*)\r?\n", re.MULTILINE)
_HEADER_MAX = 1 << 20
_KINDS = {"": "<i2", "BINARY": "<i2", "BINARY_32": "<i4"}


def _maps(file: BinaryIO) -> list[StoredMap]:
    file.seek(0)
    header = file.read(_HEADER_MAX)
    end = _DATA.search(header)
    if end is None:
        raise ValueError("the header has no end")
    common: dict[str, str] = {}
    entries, buffers = common, []
    for line in decoded(header[: end.start()]).splitlines():
        key, value = line[:_KEY_WIDTH].strip(), line[_KEY_WIDTH:].strip()
        if key == "bufferLabel":
            entries = {}
            buffers.append(entries)
        if key:
            entries[key] = value
    kind = _KINDS[end[1].decode()]
    shape = int(common["yPixels"]), int(common["xPixels"])
    height, width = (float(common.get(key) or "nan") for key in ("yLength", "xLength"))
    pixel = height / max(1, shape[0]), width / max(1, shape[1])
    start, maps = end.end(), []
    for buffer in buffers:
        block = Block(start, shape, kind).within(file)
        start += block.nbytes
        size, base = in_base_units(buffer.get("bufferUnit", ""))
        scale = float(buffer["bufferRange"]) * size / 2.0 ** (8 * np.dtype(kind).itemsize - 1)
        direction = buffer.get("direction", buffer.get("trace", "")).lower()
        channel = Channel(buffer["bufferLabel"], direction, base, common["fileType"] == "Image")
        maps.append(StoredMap(channel, shape, pixel, partial(_values, block, scale)))
    return maps


def _values(block: Block, scale: float, file: BinaryIO) -> np.ndarray:
    return block.scaled(file, scale=scale)[::-1]


def _begins(beginning: bytes) -> bool:
    return _BEGINNING.match(beginning) is not None


AGILENT = ScanReader("Agilent", (".mi",), _begins, _maps)
