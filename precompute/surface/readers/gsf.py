# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of Gwyddion Simple Field .gsf: lines "KEY = VALUE", one to four zero bytes, then 32-bit floats from the top.

(Format: Gwyddion's user guide, "Gwyddion Simple Field".)"""

from __future__ import annotations

from functools import partial
from typing import BinaryIO

import numpy as np

from .channels import Channel, unit_over
from .number_text import decoded
from .scan_file import Block, ScanReader, StoredMap
from .units import in_base_units

_BEGINNING = b"Gwyddion Simple Field 1."
_HEADER_MAX = 1 << 16


def _maps(file: BinaryIO) -> list[StoredMap]:
    file.seek(0)
    header, zero, _ = file.read(_HEADER_MAX).partition(b"\0")
    if not zero:
        raise ValueError("the header has no end")
    pairs = (line.partition("=") for line in decoded(header).splitlines()[1:])
    entries = {key.strip(): value.strip() for key, _, value in pairs}
    shape = int(entries["YRes"]), int(entries["XRes"])
    across, base = in_base_units(entries.get("XYUnits", ""))
    size, unit = in_base_units(entries.get("ZUnits", ""))
    # At least one zero pads the header to a multiple of 4 bytes.
    block = Block(len(header) + 4 - len(header) % 4, shape, "<f4").within(file)
    sides = (float(entries.get(key, "1")) * across for key in ("YReal", "XReal"))
    height, width = sides
    channel = Channel(entries.get("Title") or "height", "", unit_over(unit, base))
    return [StoredMap(channel, shape, (height / shape[0], width / shape[1]), partial(_values, block, size))]


def _values(block: Block, scale: float, file: BinaryIO) -> np.ndarray:
    return block.scaled(file, scale=scale)


def _begins(beginning: bytes) -> bool:
    return beginning.startswith(_BEGINNING)


GSF = ScanReader("Gwyddion Simple Field", (".gsf",), _begins, _maps)
