# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of Nanosurf .nid: an INI-like header, then the channels as blocks of integers.

The header ends with "#!". Its [DataSet] section lists the channels of each group, and for each the section that
describes it. The channels' data follow in the same order. Lines run from the scan's bottom up. An integer is a fraction
of the range that the channel's section declares."""

from __future__ import annotations

import re
from functools import partial
from typing import BinaryIO

import numpy as np

from .scan_file import Block, Channel, ScanReader, StoredMap, decoded, in_base_units

_BEGINNING = b"[DataSet]"
_HEADER_END = b"\n#!"
# The bytes read at a time, more than most headers have, and the longest header.
_HEADER_STEP, _HEADER_MAX = 1 << 16, 1 << 22
# A channel's key in the index: its group, and its number in the group.
_INDEX = re.compile(r"Gr(\d{1,4})-Ch(\d{1,4})")
_BITS = (8, 16, 32)


def _maps(file: BinaryIO) -> list[StoredMap]:
    header, start = _header(file)
    sections = _sections(header)
    index = sections["DataSet"]
    places = {tuple(map(int, found.groups())): key for key in index if (found := _INDEX.fullmatch(key))}
    maps = []
    for _, key in sorted(places.items()):
        entries = sections[index[key]]
        block = _block(entries, start).within(file)
        start += block.nbytes
        maps.append(_map(entries, block))
    return maps


def _header(file: BinaryIO) -> tuple[str, int]:
    """Read the header, and the position of the data. Raises ValueError if it has no end."""
    header, end = bytearray(), -1
    file.seek(0)
    while end < 0 and len(header) < _HEADER_MAX and (step := file.read(_HEADER_STEP)):
        header += step
        end = header.find(_HEADER_END, max(0, len(header) - len(step) - len(_HEADER_END)))
    if end < 0:
        raise ValueError("the header has no end")
    return decoded(bytes(header[:end])), end + len(_HEADER_END)


def _sections(header: str) -> dict[str, dict[str, str]]:
    """Split the header into the entries of each [section]."""
    sections: dict[str, dict[str, str]] = {}
    entries: dict[str, str] = {}
    for line in header.splitlines():
        if line.startswith("[") and line.endswith("]"):
            entries = sections.setdefault(line[1:-1], {})
        elif "=" in line:
            key, value = line.split("=", 1)
            entries[key.strip()] = value.strip()
    return sections


def _block(entries: dict[str, str], start: int) -> Block:
    """Locate a channel's integers. Raises KeyError or ValueError for a missing or wrong entry."""
    lines, points, bits = (int(entries[key]) for key in ("Lines", "Points", "SaveBits"))
    if bits not in _BITS or entries["SaveMode"] != "Binary" or entries["SaveOrder"] != "Intel":
        raise ValueError(f"{bits} bits saved as {entries['SaveMode']}, {entries['SaveOrder']}")
    return Block(start, (lines, points), f"<{'i' if entries['SaveSign'] == 'Signed' else 'u'}{bits // 8}")


def _map(entries: dict[str, str], block: Block) -> StoredMap:
    (across, base_x), (up, base_y), (size, base) = (
        in_base_units(entries.get(f"Dim{number}Unit", "")) for number in range(3)
    )
    channel = Channel(
        name=entries.get("Dim2Name", "unnamed"),
        frame=entries.get("Frame", "").removeprefix("Scan "),
        unit=base,
        # A force curve is in metres too, but over one length, time or voltage.
        is_image=base_x == base_y == "m",
    )
    height, width = float(entries.get("Dim1Range", "nan")) * up, float(entries["Dim0Range"]) * across
    lowest, span = float(entries["Dim2Min"]) * size, float(entries["Dim2Range"]) * size
    middle = 0.5 if np.dtype(block.kind).kind == "i" else 0.0
    scale = span / 2.0 ** (8 * np.dtype(block.kind).itemsize)
    pixel_size_m = height / block.shape[0], width / block.shape[1]
    return StoredMap(channel, block.shape, pixel_size_m, partial(_values, block, scale, lowest + middle * span))


def _values(block: Block, scale: float, offset: float, file: BinaryIO) -> np.ndarray:
    return block.scaled(file, scale=scale, offset=offset)[::-1]


def _begins(beginning: bytes) -> bool:
    return beginning.startswith(_BEGINNING)


NANOSURF = ScanReader("Nanosurf", (".nid",), _begins, _maps)
