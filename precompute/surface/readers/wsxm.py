# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of WSxM .stp and .top: a text header, then one channel, rotated by 180 degrees.

The range of integers is scaled to the header's "Z Amplitude"; floats are in its unit. (I. Horcas et al., "WSXM", Rev.
Sci. Instrum. 78, 013705, 2007.)"""

from __future__ import annotations

import re
from functools import partial
from typing import BinaryIO

import numpy as np

from .scan_file import Block, Channel, ScanReader, StoredMap, decoded, in_base_units, in_metres

_BEGINNING = b"WSxM file copyright"
_HEADER_BYTES = re.compile(rb"header size: *(\d{1,7})")
_END = b"[Header end]"
_KINDS = {"short": "<i2", "int": "<i4", "float": "<f4", "double": "<f8"}


def _maps(file: BinaryIO) -> list[StoredMap]:
    file.seek(0)
    head = file.read(4096)
    found = _HEADER_BYTES.search(head)
    if found is None:
        raise ValueError("the header does not state its length")
    start = int(found[1])
    file.seek(0)
    header = file.read(start)
    if _END not in header:
        raise ValueError("the header has no end")
    sections = _sections(decoded(header))
    general, control = sections["General Info"], sections["Control"]
    if not head.partition(b"\n")[2].startswith(b"SxM Image file"):
        raise ValueError("no image")
    shape = int(general["Number of rows"]), int(general["Number of columns"])
    kind = general.get("Image Data Type", "short")
    block = Block(start, shape, _KINDS[kind]).within(file)
    amplitude, _, unit = general["Z Amplitude"].partition(" ")
    size, base = in_base_units(unit)
    # A square scan may give only one side.
    width = in_metres(control["X Amplitude"])
    height = in_metres(control.get("Y Amplitude", control["X Amplitude"]))
    span = float(amplitude) * size if kind in ("short", "int") else None
    channel = Channel(
        general.get("Acquisition channel", "unnamed"), general.get("X scanning direction", "").lower(), base
    )
    return [StoredMap(channel, shape, (height / shape[0], width / shape[1]), partial(_values, block, size, span))]


def _values(block: Block, unit: float, span: float | None, file: BinaryIO) -> np.ndarray:
    """Read the values (rows, cols); `span` is the height range of integers, None for floats."""
    stored = block.read(file)[::-1, ::-1]
    if span is not None:
        steps = int(stored.max()) - int(stored.min())
        unit = span / steps if steps else 0.0
    return stored * np.float64(unit)


def _sections(header: str) -> dict[str, dict[str, str]]:
    sections: dict[str, dict[str, str]] = {}
    entries: dict[str, str] = {}
    for line in map(str.strip, header.splitlines()):
        if line.startswith("[") and line.endswith("]"):
            entries = sections.setdefault(line[1:-1], {})
        elif ": " in line:
            key, value = line.split(": ", 1)
            entries[key] = value.strip()
    return sections


def _begins(beginning: bytes) -> bool:
    return beginning.startswith(_BEGINNING)


WSXM = ScanReader("WSxM", (".stp", ".top"), _begins, _maps)
