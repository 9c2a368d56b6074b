# SPDX-License-Identifier: GPL-3.0-or-later
"""Valid files of further microscopes, with the same heights and conventions as in instruments.py."""

import struct

import numpy as np

from .instruments import SPAN_M


def ntmdt(height: np.ndarray, pixel_m: float, *, points: int = 0) -> bytes:
    """An NT-MDT file of scanned frames: the height, a phase without a title, and a set of curves.

    The height's frame lists `points` places where curves were measured."""
    rows, cols = height.shape
    step = SPAN_M / 2**16
    frames = []
    for title, signal, values, unit, scale in (
        ("Height", 0, np.round((height - 100e-9) / step), -1, step * 1e9),
        ("", 5, _columns(height), 5, 1.0),
    ):
        axis = struct.pack("<2fh", 0.0, pixel_m * 1e10, 0)
        offset = 100.0 if title else 0.0
        head = (2 * axis + struct.pack("<2fh2B2H", offset, scale, unit, signal, 1, cols, rows)).ljust(80, b"\0")
        listed = bytes(14 + 16 * points) if points and title else b""
        sizes = struct.pack("<4H", 0, cols, rows, points if title else 0) + listed
        comment = "<FrameComment><ScanDirection>Forward</ScanDirection></FrameComment>".encode("utf-16-le")
        texts = b"".join(struct.pack("<I", len(text)) + text for text in (title.encode("cp1251"), comment))
        frames.append(ntmdt_frame(0, head, sizes + values[::-1].astype("<i2").tobytes() + texts))
    return ntmdt_file([*frames, ntmdt_frame(201, bytes(80), bytes(20))])


def ntmdt_mda(height: np.ndarray, pixel_m: float, *, kind: str = "<f8") -> bytes:
    """An NT-MDT file of MDA frames: a text, a current, the height backward and forward, and a spectrum."""
    step = 1e-9 if kind == "<f8" else SPAN_M / 2**16
    axes = [(pixel_m * 1e6, "um", side - 1, -8) for side in height.shape[::-1]]
    code = {"<f8": -13320, "<i2": -2}[kind]
    frames = [ntmdt_frame(3, b"", b"text")]
    for title, unit, values in (
        ("1F:Iprobe", "nA", _columns(height)),
        ("1B:Height", "", -height),
        ("1F:Height", "", height),
    ):
        scale = 1.0 if unit else step
        stored = np.round(values / scale) if kind == "<i2" else values / scale
        # Heights have no unit here; their axis code gives metres.
        quantity = (scale, unit, 2**64 - 1, code)
        frames.append(_mda_frame(title, axes, [quantity], stored[::-1].astype(kind).tobytes(), np.dtype(kind).itemsize))
    frames.append(_mda_frame("Raman", axes[:1], [(1.0, "", 2**64 - 1, code)], bytes(80), 8))
    return ntmdt_file(frames)


def _columns(height: np.ndarray) -> np.ndarray:
    return np.broadcast_to(np.arange(height.shape[1], dtype=float), height.shape)


def ntmdt_file(frames: list[bytes]) -> bytes:
    """Join frames into a file."""
    body = b"".join(frames)
    return b"\x01\xb0\x93\xff" + struct.pack("<I4xH", len(body), len(frames) - 1).ljust(29, b"\0") + body


def ntmdt_frame(kind: int, head: bytes, data: bytes) -> bytes:
    """One frame from its header and its data."""
    size = 22 + len(head) + len(data)
    return struct.pack("<IH2B6HH", size, kind, 7, 3, 2026, 1, 2, 3, 4, 5, len(head)) + head + data


def _mda_frame(title: str, axes: list, quantities: list, data: bytes, cell: int) -> bytes:
    """A frame whose axes and quantities are (scale, unit, highest index, code of the number type)."""
    comment, view = "<FrameComment/>".encode("utf-16-le"), bytes(11)
    array = struct.pack("<IIQ3I", 0, 33, len(data) // cell, cell, len(axes), len(quantities)).ljust(41, b"\0")
    for scale, unit, highest, code in (*axes, *quantities):
        named = unit.encode()
        metres = 0x101 if not named else 1
        head = struct.pack("<I3IQ2d2d2QiI", 112, len(named), 0, len(named), metres, 0, 0, 0, scale, 0, highest, code, 0)
        array += struct.pack("<I", 120 + 2 * len(named)) + head.ljust(116, b"\0") + 2 * named
    lengths = (len(title), len(comment), 0, len(view), 0, len(array), 0, len(data))
    head = struct.pack("<II36x8I", 76, 76 + len(title), *lengths)
    return ntmdt_frame(106, b"", head + title.encode() + comment + view + array + data)


def sxm(height: np.ndarray, pixel_m: float, *, upward: bool = True, version: int = 2) -> bytes:
    """A Nanonis scan with the current and the height forward and backward, and an amplitude forward only; NaN marks
    pixels that were not scanned."""
    rows, cols = height.shape
    pixels = f"{cols} {rows}" if version > 1 else f"{rows} {cols}"
    channels = (("Current", "A", "both"), ("Z", "m", "both"), ("Amplitude", "m", "forward"))
    lines = [":NANONIS_VERSION:", str(version), ":SCANIT_TYPE:", "              FLOAT            MSBFIRST"]
    lines += [":ACQ_TIME:", "       470.3", ":SCAN_PIXELS:", f"       {pixels}", ":SCAN_RANGE:"]
    lines += [f"  {cols * pixel_m!r}  {rows * pixel_m!r}", ":SCAN_DIR:", "up" if upward else "down", ":COMMENT:", ""]
    lines += [":DATA_INFO:", "\tChannel\tName\tUnit\tDirection\tCalibration\tOffset"]
    lines += [f"\t{number}\t{name}\t{unit}\t{way}\t1.0\t0.0" for number, (name, unit, way) in enumerate(channels)]
    maps = (_columns(height), -_columns(height)[:, ::-1], height, -height[:, ::-1], height)
    header = "\n".join([*lines, "", ":SCANIT_END:", "\n\n"]).encode()
    step = -1 if upward else 1
    return header + b"\x1a\x04" + b"".join(values[::step].astype(">f4").tobytes() for values in maps)


def asd(
    height: np.ndarray, pixel_m: float, *, version: int = 1, frames: int = 2, range_code: int = 0x00040000
) -> bytes:
    """A high-speed movie of the height and a phase; the heights of frame n are those of the first divided by n.

    The converter has a range of -5 V to 5 V and 15 bits."""
    rows, cols = height.shape
    bits, extension, gain = 15, SPAN_M * 1e9 / 20, 2.0
    sides, name, comment = (round(cols * pixel_m * 1e9), round(rows * pixel_m * 1e9)), b"operator", b"comment"
    if version == 0:
        head = struct.pack("<i2s2s5i", 0, b"TP", b"PH", 0, 32, len(name), 5, len(comment))
        head += struct.pack("<4h3fIi", cols, rows, *sides, 1000, extension, gain, range_code, bits)
        head = head.ljust(91, b"\0") + struct.pack("<3ih", frames, frames, 1, 1) + name + bytes(12 + 5) + comment
    else:
        head = struct.pack("<6i", version, 165 + len(name + comment), 32, 932, len(name), len(comment))
        head += struct.pack("<4s4s8i", b"TP", b"PH", frames, frames, 1, 1, cols, rows, *sides)
        head = head.ljust(129, b"\0") + struct.pack("<iIi6f", 1, range_code, bits, 1, 1, 1, 1, extension, gain)
        head += name + comment
    levels = [np.round((0.5 - height / (frame + 1) / SPAN_M) * 2.0**bits) for frame in range(frames)]
    stored = levels + frames * [_columns(height)]
    return head + b"".join(bytes(32) + each[::-1].astype("<i2").tobytes() for each in stored)
