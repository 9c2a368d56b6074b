# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of Igor binary waves of version 5 (.ibw), as Asylum Research's microscopes write them.

A file has a header with the lengths of all parts, the wave's header, the values, the note, and labels. Values run along
x, then along y from the bottom up, then over the channels. The labels of the third dimension name the channels and
directions: "HeightTrace". (Format: WaveMetrics, Technical Note 003.)"""

from __future__ import annotations

import struct
from functools import partial
from typing import BinaryIO

import numpy as np

from .scan_file import Block, Channel, ScanReader, StoredMap, decoded, in_base_units, read_exactly, unit_over

_VERSION, _HEAD_BYTES = 5, 64
# The wave's header without the first values, which the wave's length includes.
_WAVE_HEAD_BYTES = 320
_KINDS = {2: "f4", 4: "f8", 8: "i1", 16: "i2", 32: "i4", 72: "u1", 80: "u2", 96: "u4"}
_LABEL_BYTES = 32
_LABELS_MAX = 1 << 16
_CHANNELS_MAX = 1000
_DIRECTIONS = ("Retrace", "Trace")
# Asylum Research writes metres, or no unit, for all channels of a file. Only these channels are lengths.
_LENGTHS = ("height", "zsensor", "z sensor", "deflection", "amplitude", "mapheight")


def _order(head: bytes) -> str | None:
    """Return a wave's byte order, "<" or ">", from its first 384 bytes; None if it is no wave of version 5."""
    if len(head) < _HEAD_BYTES + _WAVE_HEAD_BYTES:
        return None
    for order in "<>":
        (version,) = struct.unpack_from(f"{order}h", head)
        # The header's 16-bit words add up to zero modulo 2^16.
        words = struct.unpack_from(f"{order}192h", head)
        if version == _VERSION and sum(words) & 0xFFFF == 0:
            return order
    return None


def _maps(file: BinaryIO) -> list[StoredMap]:
    head = read_exactly(file, 0, _HEAD_BYTES + _WAVE_HEAD_BYTES)
    order = _order(head)
    if order is None:
        raise ValueError(f"no wave of version {_VERSION}")
    wave_bytes, formula, note, data_unit, *sizes = struct.unpack_from(f"{order}4i8i", head, 4)
    (code,) = struct.unpack_from(f"{order}h", head, _HEAD_BYTES + 16)
    cols, rows, layers, more = struct.unpack_from(f"{order}4i", head, _HEAD_BYTES + 68)
    step = struct.unpack_from(f"{order}2d", head, _HEAD_BYTES + 84)
    if code not in _KINDS or more > 1 or layers > _CHANNELS_MAX or min(formula, note, data_unit, *sizes) < 0:
        raise ValueError(f"a wave of kind {code} and {layers} layers")
    units = [
        decoded(head[_HEAD_BYTES + at : _HEAD_BYTES + at + 4].partition(b"\0")[0]).strip() for at in (148, 152, 156)
    ]
    # A wave of one dimension is a curve, and so is one of two dimensions without lengths, unless it is square.
    is_image = rows > 0 and (layers > 0 or rows == cols or [in_base_units(unit)[1] for unit in units[1:]] == ["m", "m"])
    # Asylum Research, whose waves have a note, omits metres.
    own_unit, unit_x, unit_y = (unit or ("m" if note > 0 else "") for unit in units)
    (size_x, base_x), (size_y, base_y) = in_base_units(unit_x), in_base_units(unit_y)
    after = _HEAD_BYTES + wave_bytes + formula + note + data_unit + sum(sizes[:4])
    labels = _labels(file, after + sum(sizes[4:6]), sizes[6])
    start, shape, kind = _HEAD_BYTES + _WAVE_HEAD_BYTES, (max(rows, 1), cols), order + _KINDS[code]
    maps = []
    for number in range(max(layers, 1)):
        block = Block(start, shape, kind).within(file)
        start += block.nbytes
        name, direction, unit = _channel(labels[number] if number < len(labels) else "", own_unit, note > 0)
        scale, base = in_base_units(unit)
        channel = Channel(name, direction, unit_over(base, base_x if base_x != "m" else base_y), is_image)
        maps.append(
            StoredMap(channel, shape, (abs(step[1]) * size_y, abs(step[0]) * size_x), partial(_values, block, scale))
        )
    return maps


def _values(block: Block, scale: float, file: BinaryIO) -> np.ndarray:
    return block.scaled(file, scale=scale)[::-1]


def _labels(file: BinaryIO, start: int, length: int) -> list[str]:
    """Read the labels of a dimension's elements, without the first, which is the dimension's own."""
    data = read_exactly(file, start, min(length, _LABELS_MAX))
    labels = [data[at : at + _LABEL_BYTES] for at in range(_LABEL_BYTES, len(data), _LABEL_BYTES)]
    return [label.partition(b"\0")[0].decode("latin-1") for label in labels]


def _channel(label: str, unit: str, is_asylum: bool) -> tuple[str, str, str]:
    """Derive name, direction and unit of a channel from its label."""
    direction = next((each for each in _DIRECTIONS if label.endswith(each)), "")
    name = label.removesuffix(direction) or "unnamed"
    if is_asylum and label and not name.casefold().startswith(_LENGTHS):
        unit = "deg" if "phase" in name.casefold() else "not in metres"
    return name, direction.lower(), unit


def _begins(beginning: bytes) -> bool:
    return _order(beginning) is not None


ASYLUM = ScanReader("Asylum Research", (".ibw",), _begins, _maps)
