# SPDX-License-Identifier: GPL-3.0-or-later
"""Valid HDF5 files of microscopes (.nhf and .h5-jpk), made with a small HDF5 writer."""

import struct
import zlib

import numpy as np

from .instruments import SPAN_M

_NOWHERE = 2**64 - 1


class Writer:
    """Writes HDF5 with the library's defaults: superblock 0, object headers 1, symbol tables."""

    def __init__(self) -> None:
        self._out = bytearray(96)

    def whole(self, root: int) -> bytes:
        """Return the file, with its root group at address `root`."""
        head = b"\x89HDF\r\n\x1a\n" + bytes([0, 0, 0, 0, 0, 8, 8, 0]) + struct.pack("<2HI", 4, 16, 0)
        head += struct.pack("<4Q", 0, _NOWHERE, len(self._out), _NOWHERE) + struct.pack("<2Q2I16x", 0, root, 0, 0)
        self._out[:96] = head
        return bytes(self._out)

    def group(self, members: dict[str, int], attributes: dict[str, object]) -> int:
        """Add a group of at most eight members; return its address."""
        names, places = bytearray(8), {}
        for name in sorted(members):
            places[name] = len(names)
            names += _padded(name.encode() + b"\0")
        heap = self._add(struct.pack("<4s4x3Q", b"HEAP", len(names), 1, self._add(bytes(names))))
        entries = b"".join(struct.pack("<2Q24x", places[name], members[name]) for name in sorted(members))
        symbols = self._add((struct.pack("<4sBxH", b"SNOD", 1, len(members)) + entries).ljust(328, b"\0"))
        last = places[max(members)] if members else 0
        tree = self._tree(0, [(struct.pack("<Q", 0), symbols)], struct.pack("<Q", last), 544)
        return self._object([(0x11, struct.pack("<2Q", tree, heap))], attributes)

    def dataset(
        self, values: np.ndarray, attributes: dict[str, object], *, chunk: tuple[int, ...], packed: bool
    ) -> int:
        """Add a chunked dataset, shuffled and deflated if `packed`; return its address."""
        leaves = []
        for corner in np.ndindex(*(-(-side // step) for side, step in zip(values.shape, chunk, strict=True))):
            at = [index * step for index, step in zip(corner, chunk, strict=True)]
            part = np.zeros(chunk, values.dtype)
            inside = values[tuple(slice(start, start + step) for start, step in zip(at, chunk, strict=True))]
            part[tuple(slice(side) for side in inside.shape)] = inside
            data = part.tobytes()
            if packed:
                data = zlib.compress(np.frombuffer(data, "u1").reshape(-1, values.dtype.itemsize).T.tobytes())
            leaves.append((struct.pack(f"<2I{len(at) + 1}Q", len(data), 0, *at, 0), self._add(data)))
        key = 16 + 8 * values.ndim
        beyond = [-(-side // step) * step for side, step in zip(values.shape, chunk, strict=True)]
        end = struct.pack(f"<2I{values.ndim + 1}Q", 0, 0, *beyond, 0)
        tree = self._tree(1, leaves, end, 24 + 65 * key + 64 * 8)
        layout = struct.pack(f"<3BQ{len(chunk) + 1}I", 3, 2, len(chunk) + 1, tree, *chunk, values.dtype.itemsize)
        # The fill value, which reads as missing, is the lowest integer.
        missing = struct.pack("<4BI", 2, 2, 2, 1, values.dtype.itemsize) + bytes(values.dtype.itemsize - 1) + b"\x80"
        messages = [(0x01, _space(values.shape)), (0x03, _number(values.dtype)), (0x05, missing), (0x08, layout)]
        if packed:
            shuffle = struct.pack("<4HI4x", 2, 0, 0, 1, values.dtype.itemsize)
            messages.append((0x0B, struct.pack("<2B6x", 1, 2) + shuffle + struct.pack("<4HI4x", 1, 0, 0, 1, 6)))
        return self._object(messages, attributes)

    def _add(self, data: bytes) -> int:
        self._out += bytes(-len(self._out) % 8)
        self._out += data
        return len(self._out) - len(data)

    def _tree(self, kind: int, leaves: list[tuple[bytes, int]], end: bytes, size: int) -> int:
        entries = b"".join(key + struct.pack("<Q", child) for key, child in leaves)
        head = struct.pack("<4s2BH2Q", b"TREE", kind, 0, len(leaves), _NOWHERE, _NOWHERE)
        return self._add((head + entries + end).ljust(size, b"\0"))

    def _object(self, messages: list[tuple[int, bytes]], attributes: dict[str, object]) -> int:
        messages = messages + [(0x0C, self._attribute(name, value)) for name, value in attributes.items()]
        body = b"".join(struct.pack("<2HB3x", kind, len(_padded(data)), 0) + _padded(data) for kind, data in messages)
        return self._add(struct.pack("<BxH2I4x", 1, len(messages), 1, len(body)) + body)

    def _attribute(self, name: str, value: object) -> bytes:
        """Encode an attribute: bytes as a fixed-length text, a str as a text in the heap, anything else as numbers."""
        shape: tuple[int, ...] = ()
        if isinstance(value, bytes):
            kind, data = struct.pack("<B3xI", 0x13, len(value)), value
        elif isinstance(value, str):
            text = value.encode()
            objects = struct.pack("<2H4xQ", 1, 1, len(text)) + _padded(text)
            objects += struct.pack("<2H4xQ", 0, 0, 4096 - 16 - len(objects))
            heap = self._add((struct.pack("<4sB3xQ", b"GCOL", 1, 4096) + objects).ljust(4096, b"\0"))
            kind = struct.pack("<4BI", 0x19, 1, 1, 0, 16) + struct.pack("<4BI", 0x13, 0, 1, 0, 1)
            data = struct.pack("<IQI", len(text), heap, 1)
        else:
            numbers = np.asarray(value)
            kind, data, shape = _number(numbers.dtype), numbers.tobytes(), numbers.shape
        named, space = name.encode() + b"\0", _space(shape)
        sizes = struct.pack("<Bx3H", 1, len(named), len(kind), len(space))
        return sizes + _padded(named) + _padded(kind) + _padded(space) + data


def _padded(data: bytes) -> bytes:
    return data + bytes(-len(data) % 8)


def _space(shape: tuple[int, ...]) -> bytes:
    return struct.pack(f"<2B6x{len(shape)}Q", 1, len(shape), *shape)


def _number(kind: np.dtype) -> bytes:
    bits = 8 * kind.itemsize
    if kind.kind == "f":
        fields = (52, 11, 0, 52, 1023) if bits == 64 else (23, 8, 0, 23, 127)
        return struct.pack("<4BI2H4BI", 0x11, 0x20, bits - 1, 0, kind.itemsize, 0, bits, *fields)
    return struct.pack("<4BI2H", 0x10, 8 * (kind.kind == "i"), 0, 0, kind.itemsize, 0, bits)


def _columns(height: np.ndarray) -> np.ndarray:
    return np.broadcast_to(np.arange(height.shape[1], dtype=float), height.shape)


def nhf(
    height: np.ndarray,
    pixel_m: float,
    *,
    version: int = 1,
    packed: bool = False,
    acquired: int | None = None,
    more: dict[str, object] | None = None,
) -> bytes:
    """A Nanosurf file with the height forward and backward, a voltage, and a wave of 3 values a point; NaN marks
    missing points.

    `acquired` is the number of scanned lines, by default all. `more` adds attributes to the channels."""
    rows, cols = height.shape
    names = ("name", "name", "name", "base_calibration")
    if version == 2:
        names = ("measurement_name", "segment_name", "signal_name", "signal_calibration")
    size = {"image_number_of_lines": rows, "image_points_per_line": cols, "image_size_x": cols * pixel_m}
    size |= {
        "image_size_y": rows * pixel_m,
        "image_number_of_lines_acquired": rows if acquired is None else acquired,
        "measurement_type": "image_line_based",
    }
    grid: dict[str, object] = {}
    if version == 2:
        size = {"rect_axis_range": [rows * pixel_m, cols * pixel_m], "group_type": "image_line_based"}
        grid = {"rect_axis_size": np.array([rows, cols], "u4")}
    lowest, highest = -(2**31) + (version == 2), 2**31 - 1
    unit = "Meter (m)" if version == 2 else "m"
    out, segments = Writer(), {}
    for number, (direction, sign) in enumerate((("Forward", 1), ("Backward", -1))):
        steps = (sign * height / SPAN_M + 0.5) * (highest - lowest) + lowest
        stored = np.where(np.isnan(steps), -(2**31), np.round(np.nan_to_num(steps)))
        members = {}
        for name, values, measure in (("Z-Controller In", _columns(height), "V"), ("Topography", stored, unit)):
            facts = {names[2]: name, f"{names[3]}_unit": measure, f"{names[3]}_min": -SPAN_M / 2}
            facts |= {f"{names[3]}_max": SPAN_M / 2, "dataset_element_type": "int32" if version == 2 else 0}
            facts |= {"signal_unit": measure} | (more or {})
            line = values[::-1].astype("<i4").ravel()
            members[f"dataset_{len(members)}"] = out.dataset(line, facts, chunk=(cols,), packed=packed)
        facts = {names[2]: "Wave", f"{names[3]}_unit": "m"}
        wave = np.zeros(3 * rows * cols, "<i2")
        members["dataset_2"] = out.dataset(wave, facts, chunk=(rows * cols,), packed=packed)
        segments[f"segment_{number}"] = out.group(members, {names[1]: direction} | grid)
    measurement = out.group(segments, {names[0]: "Image 1"} | size)
    major = {"nsf_file_version_major": version, "nsf_file_version_minor": 1}
    return out.whole(out.group({"measurement_0": measurement}, major))


def h5_jpk(height: np.ndarray, pixel_m: float, *, reflected: bool = False, frames: int = 2) -> bytes:
    """A JPK file of frames, with the height forward and backward and an amplitude. The heights of frame n are those of
    the first divided by n."""
    rows, cols = height.shape
    factor, offset = SPAN_M / 2**32, 100e-9
    grid: dict[str, object] = {"ilength": np.int32(cols), "jlength": np.int32(rows), "unit.unit": b"m"}
    grid |= {"ulength": cols * pixel_m, "vlength": rows * pixel_m, "reflect": b"true" if reflected else b"false"}
    out, channels = Writer(), {}
    for name, fancy, retrace, sign in (
        ("height", b"Height", b"true", -1),
        ("height", b"Height", b"false", 1),
        ("amplitude", b"Lock-In Amplitude", b"false", 1),
    ):
        columns = [sign * height / (frame + 1) for frame in range(frames)]
        stored = np.stack([(each if reflected else each[::-1]).ravel() for each in columns], axis=1)
        steps = np.round((stored - offset) / factor).astype("<i4")
        scaling = {"multiplier": factor, "offset": offset, "unit.unit": b"m"}
        facts = {f"net-encoder.scaling.{key}": value for key, value in scaling.items()}
        facts |= {"channel.name": name.encode(), "channel.fancy-name": fancy, "retrace": retrace}
        members = {
            name.capitalize(): out.dataset(steps, {}, chunk=(rows * cols, 1), packed=True),
            "thumbnail": out.dataset(np.zeros((16, 1), "<i4"), {}, chunk=(64, 1), packed=True),
        }
        channels[f"Channel_{len(channels):03}"] = out.group(members, facts)
    measurement = out.group(channels, {f"position-pattern.grid.{key}": value for key, value in grid.items()})
    return out.whole(out.group({"Measurement_000": measurement}, {"file-format-info": b"JPK SCAN"}))


def nhf_continued_in_a_circle() -> bytes:
    """A file whose root header continues in itself and is full of empty messages."""
    out = Writer()
    root = out.group({}, {"nsf_file_version_major": 1})
    whole = bytearray(out.whole(root))
    start, empty = len(whole), bytes(8 * 8000)
    whole += struct.pack("<2HB3x2Q", 0x10, 16, 0, start, 24 + len(empty)) + empty
    struct.pack_into("<I", whole, root + 8, len(whole) - root - 16)
    return bytes(whole)


def nhf_of_zeros() -> bytes:
    """6000 x 6000 heights of zero in 150 KB; reading them takes 800 MiB."""
    out, side = Writer(), 6000
    values = np.broadcast_to(np.zeros(1, "<i4"), (side * side,))
    facts = {"name": "Topography", "base_calibration_unit": "m"}
    channel = out.dataset(values, facts, chunk=(side * 100,), packed=True)
    segment = out.group({"dataset_0": channel}, {"name": "Forward"})
    size = {"image_number_of_lines": side, "image_points_per_line": side, "image_size_x": 1e-5, "image_size_y": 1e-5}
    measurement = out.group({"segment_0": segment}, {"name": "Image 1"} | size)
    return out.whole(out.group({"measurement_0": measurement}, {"nsf_file_version_major": 1}))
