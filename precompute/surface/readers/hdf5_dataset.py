# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of HDF5 datasets: numbers, contiguous or in chunks, which may be deflated and shuffled.

Every size in a header is checked against the file before memory is allocated. (Format: The HDF Group, "HDF5 File Format
Specification", version 3.)"""

from __future__ import annotations

import math
import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np

from ...base.strict_zip import MOST_PACKED
from .scan_file import read_exactly

UNDEFINED = 2**64 - 1
# The most bytes of structures, and the most structures, of a file. A scan has a hundredth of them.
_STRUCTURES_MAX, _READS_MAX = 1 << 24, 1 << 18
# The largest chunk in bytes, or as a multiple of the wanted values: datasets grow, and frames may share a chunk.
_CHUNK_MAX, _CHUNK_TIMES = 1 << 20, 4
_DEFLATE, _SHUFFLE, _FLETCHER = 1, 2, 3


class Structures:
    """Reads the structures of an open HDF5 file, as bytes and numbers."""

    def __init__(self, file: BinaryIO):
        self._file, self._bytes, self._reads = file, 0, 0

    def read(self, start: int, count: int) -> bytes:
        """Read bytes of a structure. Raises ValueError if the file has more structures than any scan."""
        self._bytes, self._reads = self._bytes + count, self._reads + 1
        if self._bytes > _STRUCTURES_MAX or self._reads > _READS_MAX:
            raise ValueError("more HDF5 structures than a scan has, or in a circle")
        return read_exactly(self._file, start, count)

    def unpack(self, form: str, start: int) -> tuple[Any, ...]:
        """Read numbers of a structure."""
        return struct.unpack(form, self.read(start, struct.calcsize(form)))


@dataclass(frozen=True)
class Dataset:
    """A stored array of numbers. `filters` are in the order in which they were applied."""

    file: Structures
    shape: tuple[int, ...]
    kind: np.dtype
    layout: bytes
    filters: tuple[int, ...]

    def read(self, file: BinaryIO, column: int | None = None) -> np.ndarray:
        """Read all values, or the values whose last index is `column`. Raises ValueError if any is not stored."""
        shape = self.shape if column is None else self.shape[:-1]
        nbytes, held = math.prod(shape) * self.kind.itemsize, file.seek(0, os.SEEK_END)
        if nbytes > MOST_PACKED * held:
            raise ValueError(f"{nbytes} bytes of values in a file of {held}")
        values = np.empty(shape, self.kind)
        filled = sum(self._fill(values, corner, part, column) for corner, part in self._parts(file, column))
        if filled != values.size:
            raise ValueError(f"{filled} of {values.size} values are stored")
        return values

    def _fill(self, values: np.ndarray, corner: tuple[int, ...], part: np.ndarray, column: int | None) -> int:
        if column is not None:
            part, corner = part[..., column - corner[-1]], corner[:-1]
        place = tuple(slice(at, at + side) for at, side in zip(corner, part.shape, strict=True))
        inside = values[place]
        inside[...] = part[tuple(slice(side) for side in inside.shape)]
        return inside.size

    def _parts(self, file: BinaryIO, column: int | None) -> Iterator[tuple[tuple[int, ...], np.ndarray]]:
        """Yield the stored parts that hold wanted values, each after the indices of its corner."""
        version, form = self.layout[:2]
        zero = (0,) * len(self.shape)
        nbytes = math.prod(self.shape) * self.kind.itemsize
        if version not in (3, 4) or form > 2 or (version == 4 and form == 2):
            raise ValueError(f"HDF5 values laid out in way {form} of version {version}")
        if form == 0:
            (size,) = struct.unpack_from("<H", self.layout, 2)
            yield zero, self._decoded(self.layout[4 : 4 + size], self.shape, nbytes, 0)
        elif form == 1:
            start, size = struct.unpack_from("<2Q", self.layout, 2)
            if start == UNDEFINED or size != nbytes:
                raise ValueError(f"{size} bytes are stored for {nbytes}")
            yield zero, np.frombuffer(read_exactly(file, start, size), self.kind).reshape(self.shape)
        else:
            yield from self._chunks(file, column)

    def _chunks(self, file: BinaryIO, column: int | None) -> Iterator[tuple[tuple[int, ...], np.ndarray]]:
        (rank,) = struct.unpack_from("<B", self.layout, 2)
        if rank != len(self.shape) + 1:
            raise ValueError(f"HDF5 chunks of {rank - 1} dimensions for {len(self.shape)}")
        root, *sides = struct.unpack_from(f"<Q{rank - 1}I", self.layout, 3)
        size = math.prod(sides) * self.kind.itemsize
        wanted = math.prod(self.shape if column is None else self.shape[:-1]) * self.kind.itemsize
        if not 0 < size <= max(_CHUNK_MAX, _CHUNK_TIMES * wanted):
            raise ValueError(f"an HDF5 chunk of {size} bytes for {wanted}")
        key = struct.Struct(f"<2I{rank}Q")
        for head, start in tree(self.file, root, kind=1, key=key):
            stored, skipped, *corner = key.unpack(head)
            if any(at >= side for at, side in zip(corner, self.shape, strict=False)):
                raise ValueError("an HDF5 chunk outside of its dataset")
            if column is None or corner[-2] <= column < corner[-2] + sides[-1]:
                data = self._decoded(read_exactly(file, start, stored), tuple(sides), size, skipped)
                yield tuple(corner[:-1]), data

    def _decoded(self, data: bytes, shape: tuple[int, ...], size: int, skipped: int) -> np.ndarray:
        """Undo the filters on stored bytes; the bits of `skipped` mark filters that were not applied."""
        for number, each in reversed(list(enumerate(self.filters))):
            if skipped >> number & 1:
                continue
            if each == _DEFLATE:
                if size > MOST_PACKED * (len(data) + 1):
                    raise ValueError(f"a chunk of {size} bytes in {len(data)}")
                # The chunk, a checksum of 4 bytes, and a byte that reveals a zip bomb.
                data = zlib.decompressobj().decompress(data, size + 5)
                if len(data) > size + 4:
                    raise ValueError(f"an HDF5 chunk unpacks to more than its {size} bytes")
            elif each == _SHUFFLE:
                data = np.frombuffer(data, "u1").reshape(self.kind.itemsize, -1).T.tobytes()
            elif each == _FLETCHER:
                data = data[:-4]
        if len(data) != size:
            raise ValueError(f"an HDF5 chunk holds {len(data)} bytes instead of {size}")
        return np.frombuffer(data, self.kind).reshape(shape)


def tree(file: Structures, root: int, *, kind: int, key: struct.Struct) -> Iterator[tuple[bytes, int]]:
    """Yield key and address of each leaf of a B-tree of version 1; an undefined root has no leaves."""
    nodes = [] if root == UNDEFINED else [root]
    while nodes:
        address = nodes.pop()
        signature, found, level, count = file.unpack("<4s2BH", address)
        if signature != b"TREE" or found != kind:
            raise ValueError("no HDF5 tree")
        entry = key.size + 8
        entries = file.read(address + 24, count * entry)
        children = []
        for at in range(0, len(entries), entry):
            (child,) = struct.unpack_from("<Q", entries, at + key.size)
            if level:
                children.append(child)
            else:
                yield entries[at : at + key.size], child
        nodes += reversed(children)


def shape_of(data: bytes) -> tuple[int, ...] | None:
    """Read the sides of a dataspace: () for one value, None for no value."""
    version, rank = data[:2]
    if version not in (1, 2) or (version == 2 and data[3] == 2):
        return None
    return struct.unpack_from(f"<{rank}Q", data, 8 if version == 1 else 4)


def number_of(data: bytes) -> np.dtype | None:
    """Return the NumPy type of a numeric datatype; None for others."""
    form, bits, size = data[0] & 15, data[1], struct.unpack_from("<I", data, 4)[0]
    order = ">" if bits & 1 else "<"
    if form == 0 and size in (1, 2, 4, 8):
        return np.dtype(f"{order}{'i' if bits & 8 else 'u'}{size}")
    if form == 1 and size in (4, 8) and not bits & 64:
        return np.dtype(f"{order}f{size}")
    return None


def filters_of(data: bytes | None) -> tuple[int, ...]:
    """Read a pipeline's filter numbers. Raises ValueError for an unsupported filter."""
    if data is None:
        return ()
    version, count = data[:2]
    at, found = 8 if version == 1 else 2, []
    for _ in range(count):
        (number,) = struct.unpack_from("<H", data, at)
        named = version == 1 or number >= 256
        length = struct.unpack_from("<H", data, at + 2)[0] if named else 0
        at += 4 if named else 2
        (values,) = struct.unpack_from("<2xH", data, at)
        at += 4 + length + 4 * (values + (values & 1 if version == 1 else 0))
        found.append(number)
    if unknown := set(found) - {_DEFLATE, _SHUFFLE, _FLETCHER}:
        raise ValueError(f"HDF5 filter {min(unknown)}")
    return tuple(found)
