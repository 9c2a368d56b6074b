# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of Gwyddion's text exports: comments with title, width, height and unit, then the heights from the top.

The reader goes by the order of the comments, since their names are translated. Numbers may have decimal commas.
(Format: Gwyddion's user guide, "Raw data and text file export".)"""

from __future__ import annotations

from functools import partial
from typing import BinaryIO

import numpy as np

from .channels import Channel
from .number_text import decoded, read_text, rows_of
from .scan_file import ScanReader, StoredMap
from .units import in_base_units, in_metres


def _facts(text: str) -> list[str]:
    """Return the values after the colons of the comments at a text's beginning."""
    facts = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        name, colon, value = line[1:].partition(":")
        if colon and name.strip():
            facts.append(value.strip())
    return facts


def _maps(file: BinaryIO) -> list[StoredMap]:
    text = read_text(file)
    *title, width, height, unit = _facts(text)
    values = rows_of(text)
    size, base = in_base_units(unit)
    pixel = in_metres(height) / values.shape[0], in_metres(width) / values.shape[1]
    channel = Channel(title[0] if title and title[0] else "height", "", base)
    return [StoredMap(channel, values.shape, pixel, partial(_heights, values, size))]


def _heights(values: np.ndarray, unit: float, file: BinaryIO) -> np.ndarray:
    return values * unit


def _begins(beginning: bytes) -> bool:
    if not beginning.startswith(b"#"):
        return False
    try:
        *_, width, height, unit = _facts(decoded(beginning))
        return in_metres(width) > 0 and in_metres(height) > 0 and bool(unit)
    except ValueError:
        return False


GWYDDION_TEXT = ScanReader("Gwyddion text", (".txt",), _begins, _maps)
