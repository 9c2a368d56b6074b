# SPDX-License-Identifier: GPL-3.0-or-later
r"""Reader of Nanonis .sxm: a header of tags between colons, each with its lines, then the channels as 32-bit floats.

The bytes 1A 04 end the header. The tag DATA_INFO lists the channels; a channel with both directions is stored forward,
then backward. An upward scan begins at the bottom. Backward lines begin at the right. Points that were not scanned are
NaN. (Format: Nanonis, "File Format Version 1", and Gwyddion's module nanonis.)"""

from __future__ import annotations

from functools import partial
from typing import BinaryIO

import numpy as np

from .scan_file import Block, Channel, ScanReader, StoredMap, in_base_units

_BEGINNING = b":NANONIS_VERSION:"
_END = b"\x1a\x04"
_HEADER_MAX = 1 << 22
# Files that declare LSBFIRST are big-endian too.
_KIND, _KINDS_TOLD = ">f4", ("FLOAT MSBFIRST", "FLOAT LSBFIRST")
_COLUMNS = ("Channel", "Name", "Unit", "Direction")
_DIRECTIONS = {"both": ("forward", "backward"), "forward": ("forward",), "backward": ("backward",)}


def _maps(file: BinaryIO) -> list[StoredMap]:
    file.seek(0)
    header = file.read(_HEADER_MAX)
    end = header.find(_END)
    if end < 0:
        raise ValueError("the header has no end")
    tags = _tags(header[:end].decode("latin-1"))
    if (kind := " ".join(_words(tags, "SCANIT_TYPE"))) not in _KINDS_TOLD:
        raise ValueError(f"values stored as {kind}")
    cols, rows = (int(word) for word in _words(tags, "SCAN_PIXELS"))
    if int(_words(tags, "NANONIS_VERSION")[0]) < 2:
        rows, cols = cols, rows
    width, height = (float(word) for word in _words(tags, "SCAN_RANGE"))
    upward = _words(tags, "SCAN_DIR")[0].lower() == "up"
    # An image cut out of a grid of spectra has no scan time, and holds one direction if it declares both.
    is_cut_out = tags.get("ACQ_TIME") == ["N/A"] or "".join(tags.get("SCAN_TIME", [])).startswith("NaN")
    ways = _DIRECTIONS | ({"both": ("forward",)} if is_cut_out else {})
    start, maps = end + len(_END), []
    for name, unit, direction in _channels(tags["DATA_INFO"]):
        size, base = in_base_units(unit)
        for way in ways[direction]:
            block = Block(start, (rows, cols), _KIND).within(file)
            start += block.nbytes
            load = partial(_values, block, size, upward, way == "backward")
            maps.append(StoredMap(Channel(name, way, base), block.shape, (height / rows, width / cols), load))
    return maps


def _tags(header: str) -> dict[str, list[str]]:
    """Split the header into the lines of each tag."""
    tags: dict[str, list[str]] = {}
    lines: list[str] = []
    for line in map(str.strip, header.splitlines()):
        if len(line) > 2 and line[0] == line[-1] == ":":
            lines = tags[line[1:-1]] = []
        elif line:
            lines.append(line)
    return tags


def _words(tags: dict[str, list[str]], tag: str) -> list[str]:
    return " ".join(tags[tag]).split()


def _channels(lines: list[str]) -> list[tuple[str, str, str]]:
    """Read name, unit and direction of each channel. Raises ValueError if the list has other columns."""
    if tuple(lines[0].split()[: len(_COLUMNS)]) != _COLUMNS:
        raise ValueError(f"channels listed by {lines[0]}")
    cells = [(line.split("\t") if "\t" in line else line.split())[1:4] for line in lines[1:]]
    return [(name, unit, direction) for name, unit, direction in cells]


def _values(block: Block, unit: float, upward: bool, backward: bool, file: BinaryIO) -> np.ndarray:
    return block.scaled(file, scale=unit)[:: -1 if upward else 1, :: -1 if backward else 1]


def _begins(beginning: bytes) -> bool:
    return beginning.startswith(_BEGINNING)


NANONIS = ScanReader("Nanonis", (".sxm",), _begins, _maps)
