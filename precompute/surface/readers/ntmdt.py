# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of NT-MDT .mdt: a sequence of frames, each a scan, a set of curves, a text or a palette.

A "scanned" frame holds a binary header, 16-bit integers, and a title. An "MDA" frame describes its axes (dimensions)
and quantities (measurands) by calibrations: index x scale + bias, in a unit. Lines run from the scan's bottom up.
(Format: Gwyddion's module nt-mdt and the Kaitai Struct description nt_mdt.ksy.)"""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import BinaryIO

import numpy as np

from .scan_file import Block, Channel, ScanReader, StoredMap, in_base_units, read_exactly

_BEGINNING = b"\x01\xb0\x93\xff"
# The first frame begins one byte later than NT-MDT documents.
_FIRST_FRAME, _FRAME_HEAD_BYTES = 33, 22
_SCANNED, _MDA, _CURVES = 0, 106, (1, 190, 201)
# A scanned frame: the three axes and the signal number; the sizes; the header and entry of a list of points.
_SCAN_HEAD, _SCAN_SIZES, _POINTS_HEAD_BYTES, _POINT_BYTES = "<2fh2fh2fhB", "<4H", 14, 16
_UNITS = {-5: "m", -4: "cm", -3: "mm", -2: "um", -1: "nm", 0: "Ang", 1: "nA", 2: "V", 3: "", 4: "kHz", 5: "deg", 6: "%"}
_UNITS |= {8: "V", 20: "A", 21: "mA", 22: "uA", 23: "nA", 24: "pA", 25: "V", 26: "mV", 30: "N", 33: "nN", 34: "pN"}
# Signal names for frames without a title.
_SIGNALS = ("Height", "DFL", "Lateral F", "Bias V", "Current", "FB Out", "Mag", "Mag*Sin", "Mag*Cos", "RMS")
# An MDA frame's number types.
_KINDS = {
    -1: "<i1",
    1: "<u1",
    -2: "<i2",
    2: "<u2",
    -4: "<i4",
    4: "<u4",
    -8: "<i8",
    8: "<u8",
    -5892: "<f4",
    -13320: "<f8",
}
# The code of metres, for calibrations without a unit's name.
_METRES = 0x101
# "1F:Height": the first pass, forward.
_PASS = re.compile(r"(\d+)([FB]):\s*(.*)")
_DIRECTION = re.compile("<ScanDirection>(\\w+)</")
_TEXT_MAX = 1 << 16


@dataclass(frozen=True)
class _Frame:
    """A frame: its kind, its first byte and the byte after its last, and the length of its own header."""

    kind: int
    start: int
    end: int
    header_bytes: int


@dataclass(frozen=True)
class _Calibration:
    """An axis or a quantity of an MDA frame: count of points, bias and scale in `unit`, and number type `kind`."""

    count: int
    bias: float
    scale: float
    unit: str
    kind: int


def _maps(file: BinaryIO) -> list[StoredMap]:
    maps = [_map(file, frame) for frame in _frames(file) if frame.kind in (_SCANNED, _MDA, *_CURVES)]
    if not maps:
        raise ValueError("no frame holds a scan")
    return maps


def _frames(file: BinaryIO) -> Iterator[_Frame]:
    """Yield all frames. Raises ValueError or EOFError if one does not end within the file."""
    size = file.seek(0, os.SEEK_END)
    (last,) = struct.unpack("<H", read_exactly(file, 12, 2))
    start = _FIRST_FRAME
    for number in range(last + 1):
        nbytes, kind, header_bytes = struct.unpack("<IH14xH", read_exactly(file, start, _FRAME_HEAD_BYTES))
        if nbytes < _FRAME_HEAD_BYTES or start + nbytes > size:
            raise ValueError(f"frame {number + 1} declares {nbytes} bytes, and {size - start} are there")
        yield _Frame(kind, start, start + nbytes, header_bytes)
        start += nbytes


def _map(file: BinaryIO, frame: _Frame) -> StoredMap:
    if frame.kind == _SCANNED:
        return _scanned(file, frame)
    if frame.kind == _MDA:
        return _mda(file, frame)
    return _curves("curves")


def _curves(title: str) -> StoredMap:
    """Make a placeholder for curves, which are listed but never read."""
    return StoredMap(Channel(title, "", "", is_image=False), (1, 1), (1.0, 1.0), partial(np.full, (1, 1), np.nan))


def _scanned(file: BinaryIO, frame: _Frame) -> StoredMap:
    start = frame.start + _FRAME_HEAD_BYTES
    head = read_exactly(file, start, struct.calcsize(_SCAN_HEAD))
    _, step_x, unit_x, _, step_y, unit_y, offset, step, unit, signal = struct.unpack(_SCAN_HEAD, head)
    start += frame.header_bytes
    _, cols, rows, points = struct.unpack(_SCAN_SIZES, read_exactly(file, start, struct.calcsize(_SCAN_SIZES)))
    start += struct.calcsize(_SCAN_SIZES) + (_POINTS_HEAD_BYTES + points * _POINT_BYTES if points else 0)
    block = _within(Block(start, (rows, cols), "<i2"), frame)
    title, after = _text(file, frame, block.start + block.nbytes, "cp1251")
    comment, _ = _text(file, frame, after, "utf-16-le")
    named = _SIGNALS[signal] if signal < len(_SIGNALS) else f"Signal {signal}"
    name, direction = _name(title or named, comment)
    (size_x, base_x), (size_y, base_y), (size, base) = (
        in_base_units(_UNITS.get(code, f"unit {code}")) for code in (unit_x, unit_y, unit)
    )
    return StoredMap(
        Channel(name, direction, base, is_image=base_x == base_y == "m"),
        block.shape,
        (abs(step_y) * size_y, abs(step_x) * size_x),
        partial(_values, block, step * size, offset * size),
    )


def _mda(file: BinaryIO, frame: _Frame) -> StoredMap:
    start = frame.start + _FRAME_HEAD_BYTES
    head_bytes, *lengths = struct.unpack("<I40x5I", read_exactly(file, start, 64))
    start += head_bytes
    title = read_exactly(file, start, min(lengths[0], _TEXT_MAX)).decode("cp1251", "replace")
    comment = read_exactly(file, start + lengths[0], min(lengths[1], _TEXT_MAX)).decode("utf-16-le", "replace")
    name, direction = _name(title or "unnamed", comment)
    start += sum(lengths)
    array_head_bytes, cell_bytes, axes, quantities = struct.unpack("<4xI8x3I", read_exactly(file, start, 28))
    if (axes, quantities) != (2, 1):
        return _curves(name)
    start += 8 + array_head_bytes
    calibrations = []
    for _ in range(axes + quantities):
        (nbytes,) = struct.unpack("<I", read_exactly(file, start, 4))
        calibrations.append(_calibration(file, start))
        start += nbytes
    x, y, z = calibrations
    if z.kind not in _KINDS or np.dtype(_KINDS[z.kind]).itemsize != cell_bytes:
        raise ValueError(f"values of kind {z.kind} in {cell_bytes} bytes")
    block = _within(Block(start, (y.count, x.count), _KINDS[z.kind]), frame)
    (size_x, base_x), (size_y, base_y), (size, base) = (in_base_units(each.unit) for each in calibrations)
    return StoredMap(
        Channel(name, direction, base, is_image=base_x == base_y == "m"),
        block.shape,
        (abs(y.scale) * size_y, abs(x.scale) * size_x),
        partial(_values, block, z.scale * size, z.bias * size),
    )


def _calibration(file: BinaryIO, start: int) -> _Calibration:
    head = struct.unpack("<4x4IQ8x8x2d2QiI", read_exactly(file, start, 84))
    struct_bytes, name, comment, unit_bytes, si_unit, bias, scale, lowest, highest, kind, _ = head
    texts = start + 8 + struct_bytes
    # Without a unit's text, the name is the unit, or the code means metres.
    unit = read_exactly(file, texts + name + comment, min(unit_bytes, _TEXT_MAX))
    unit = unit or read_exactly(file, texts, min(name, _TEXT_MAX))
    try:
        named = unit.decode("utf-8")
    except UnicodeDecodeError:
        named = unit.decode("latin-1")
    named = named.strip("\0 ") or ("m" if si_unit == _METRES else "")
    return _Calibration(highest - lowest + 1, bias, scale, named, kind)


def _within(block: Block, frame: _Frame) -> Block:
    """Return the block. Raises ValueError if it does not end within the frame."""
    if block.start + block.nbytes > frame.end:
        raise ValueError(
            f"a frame of {frame.end - frame.start} bytes declares {block.shape[0]} x {block.shape[1]} values"
        )
    return block


def _text(file: BinaryIO, frame: _Frame, start: int, encoding: str) -> tuple[str, int]:
    """Read a text after its length, "" if the frame ends before it, and return the text and its end."""
    if start + 4 > frame.end:
        return "", frame.end
    (nbytes,) = struct.unpack("<I", read_exactly(file, start, 4))
    if nbytes > frame.end - start - 4:
        return "", frame.end
    data = read_exactly(file, start + 4, min(nbytes, _TEXT_MAX))
    return data.decode(encoding, "replace").strip("\0 "), start + 4 + nbytes


def _name(title: str, comment: str) -> tuple[str, str]:
    """Read name and direction of a scan from its title ("2B:Height": second pass, backward) or its comment."""
    found = _PASS.fullmatch(title)
    if found is None:
        told = _DIRECTION.search(comment)
        return title, told[1].lower() if told else ""
    direction = "forward" if found[2] == "F" else "backward"
    return found[3], direction if found[1] == "1" else f"{direction} {found[1]}"


def _values(block: Block, scale: float, offset: float, file: BinaryIO) -> np.ndarray:
    return block.scaled(file, scale=scale, offset=offset)[::-1]


def _begins(beginning: bytes) -> bool:
    return beginning.startswith(_BEGINNING)


NT_MDT = ScanReader("NT-MDT", (".mdt",), _begins, _maps)
