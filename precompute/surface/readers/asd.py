# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of high-speed AFM .asd of Olympus and RIBM: a header, then the frames of one or two channels as integers.

The header's first number is its version, 0 to 2. A frame is a header, then its points (usually 12 bits), line by line
from the scan's bottom up. The lowest integer is the highest voltage of the converter's range. Heights are voltages
times the piezo's nanometres per volt times the driver's gain. (Format: the libraries libasd and AFMReader; order of the
lines: the viewer pyNuD.)"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import BinaryIO

import numpy as np

from .scan_file import Block, Channel, ScanReader, StoredMap, read_exactly

_NAMES = {b"TP": ("Topography", "m"), b"ER": ("Error", "V"), b"PH": ("Phase", "deg")}
_NO_CHANNEL = b"\0\0"
# The converter's codes for ranges from -V to V volts. Existing readers disagree on the sign of ranges from 0 to V.
_BIPOLAR_V = {0x00010000: 1.0, 0x00020000: 2.5, 0x00040000: 5.0}
_BITS_MAX, _FRAMES_MAX = 16, 1 << 16
_UNIPOLAR = "levels of a unipolar converter"
# The position of the operator's name in version 0, and the bytes between this name and the comment.
_NAME_0, _AFTER_NAME_0 = 105, 12
# Bytes of the header of versions 1 and 2 before its texts.
_HEADER_BYTES = 165


@dataclass(frozen=True)
class _Header:
    """The facts of a file's header; `nm_per_volt` includes the driver's gain."""

    start: int
    frame_header_bytes: int
    channels: tuple[bytes, bytes]
    frames: int
    shape: tuple[int, int]
    sides_nm: tuple[float, float]
    range_code: int
    bits: int
    nm_per_volt: float


def _header(file: BinaryIO) -> _Header:
    (version,) = struct.unpack("<i", read_exactly(file, 0, 4))
    head = read_exactly(file, 0, _NAME_0 if version == 0 else _HEADER_BYTES)
    if version == 0:
        # The length in this header is not always right.
        frame_header_bytes, *texts = struct.unpack_from("<4i", head, 12)
        start = _NAME_0 + _AFTER_NAME_0 + sum(texts)
        channels = head[4:6], head[6:8]
        cols, rows, width, height = struct.unpack_from("<4h", head, 28)
        extension, gain, range_code, bits = struct.unpack_from("<2fIi", head, 40)
        (frames,) = struct.unpack_from("<i", head, 95)
    else:
        start, frame_header_bytes = struct.unpack_from("<2i", head, 4)
        channels = head[24:26], head[28:30]
        (frames,) = struct.unpack_from("<i", head, 36)
        cols, rows, width, height = struct.unpack_from("<4i", head, 48)
        range_code, bits, extension, gain = struct.unpack_from("<Ii16x2f", head, 133)
    sizes = (rows, cols), (height, width)
    return _Header(start, frame_header_bytes, channels, frames, *sizes, range_code, bits, extension * gain)


def _maps(file: BinaryIO) -> list[StoredMap]:
    header = _header(file)
    held = [name for name in header.channels if name != _NO_CHANNEL]
    if not 1 <= header.frames * len(held) <= _FRAMES_MAX or not 1 <= header.bits <= _BITS_MAX:
        raise ValueError(f"{header.frames} frames of {len(held)} channels of {header.bits} bits")
    if header.frame_header_bytes < 0 or header.start < 0:
        raise ValueError("a header of less than no bytes")
    return list(_frames(file, header, held))


def _frames(file: BinaryIO, header: _Header, held: list[bytes]) -> Iterator[StoredMap]:
    """Yield the frames of all channels, the first of each before the second. A channel's frames are stored together."""
    rows, cols = header.shape
    stride = header.frame_header_bytes + 2 * rows * cols
    volts = _BIPOLAR_V.get(header.range_code)
    scale = -2.0 * (volts or 0.0) / 2.0**header.bits * header.nm_per_volt * 1e-9
    offset = (volts or 0.0) * header.nm_per_volt * 1e-9
    for frame in range(header.frames):
        for place, code in enumerate(held):
            start = header.start + (place * header.frames + frame) * stride + header.frame_header_bytes
            block = Block(start, header.shape, "<i2").within(file)
            name, unit = _NAMES.get(code, (code.decode("latin-1"), "unknown levels"))
            number = str(frame + 1) if header.frames > 1 else ""
            yield StoredMap(
                Channel(name, number, _UNIPOLAR if unit == "m" and volts is None else unit),
                header.shape,
                (header.sides_nm[0] * 1e-9 / rows, header.sides_nm[1] * 1e-9 / cols),
                partial(_values, block, scale, offset),
            )


def _values(block: Block, scale: float, offset: float, file: BinaryIO) -> np.ndarray:
    return block.scaled(file, scale=scale, offset=offset)[::-1]


def _begins(beginning: bytes) -> bool:
    if len(beginning) < _NAME_0:
        return False
    codes = (*_NAMES, _NO_CHANNEL)
    if beginning[:4] == bytes(4):
        return beginning[4:6] in _NAMES and beginning[6:8] in codes
    ends = beginning[26:28], beginning[30:32]
    return (
        beginning[:4] in (b"\1\0\0\0", b"\2\0\0\0")
        and beginning[24:26] in _NAMES
        and beginning[28:30] in codes
        and ends == (bytes(2), bytes(2))
    )


ASD = ScanReader("high-speed AFM", (".asd",), _begins, _maps)
