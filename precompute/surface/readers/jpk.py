# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of JPK .jpk and .jpk-qi-image: a TIFF with a thumbnail and the scan's size, then a page for each channel.

A channel has slots, which scale its integers to volts, nominal or calibrated heights. The reader uses the default slot.
Lines run from the scan's bottom up, unless it is reflected. (Format: JPK Instruments, "JPK image file specification".)
"""

from __future__ import annotations

from functools import partial
from typing import BinaryIO

import numpy as np

from .channels import Channel
from .scan_file import Block, ScanReader, StoredMap
from .tiff_file import Tag, pages, picture, tags_at_start
from .units import in_base_units

_VERSION, _WIDTH, _HEIGHT, _REFLECTED = 32768, 32834, 32835, 32837
_NAME, _IS_RETRACE, _FANCY_NAME, _SLOTS, _DEFAULT = 32848, 32849, 32850, 32896, 32897
# The first slot's first tag, the step between slots, and the offsets in a slot: unit, scaling type, factor, offset.
_SLOT, _SLOT_STEP, _UNIT, _SCALING, _FACTOR, _OFFSET = 32912, 48, 18, 19, 20, 21
_SLOTS_MAX = 100


def _maps(file: BinaryIO) -> list[StoredMap]:
    first, *channels = pages(file)
    height, width = (first[tag].number(file) for tag in (_HEIGHT, _WIDTH))
    return [_map(file, page, (height, width)) for page in channels if _NAME in page]


def _map(file: BinaryIO, page: dict[int, Tag], sides: tuple[float, float]) -> StoredMap:
    reflected = _REFLECTED in page and page[_REFLECTED].number(file) != 0
    shape, strips = picture(file, page)
    unit, factor, offset = _scaling(file, page)
    size, base = in_base_units(unit)
    name = page[_FANCY_NAME if _FANCY_NAME in page else _NAME].text(file)
    is_retrace = _IS_RETRACE in page and page[_IS_RETRACE].number(file) != 0
    return StoredMap(
        Channel(name, "retrace" if is_retrace else "trace", base),
        shape,
        (sides[0] / shape[0], sides[1] / shape[1]),
        partial(_values, strips, factor * size, offset * size, reflected),
    )


def _scaling(file: BinaryIO, page: dict[int, Tag]) -> tuple[str, float, float]:
    """Read unit, factor and offset of the default slot; without one, a unit that makes only this channel unusable."""
    wanted = page[_DEFAULT].text(file)
    for slot in range(min(int(page[_SLOTS].number(file)), _SLOTS_MAX)):
        at = _SLOT + slot * _SLOT_STEP
        if page[at].text(file) == wanted:
            if page[at + _SCALING].text(file) != "LinearScaling":
                return "", 1.0, 0.0
            unit, factor, offset = page[at + _UNIT], page[at + _FACTOR], page[at + _OFFSET]
            return unit.text(file), factor.number(file), offset.number(file)
    return "an unknown unit", 1.0, 0.0


def _values(strips: list[Block], factor: float, offset: float, reflected: bool, file: BinaryIO) -> np.ndarray:
    values = np.concatenate([strip.read(file) for strip in strips]) * np.float64(factor)
    values += offset
    return values if reflected else values[::-1]


def _begins(beginning: bytes) -> bool:
    return _VERSION in tags_at_start(beginning)


JPK = ScanReader("JPK", (".jpk", ".jpk-qi-image"), _begins, _maps)
