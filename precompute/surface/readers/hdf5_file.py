# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of HDF5 as instruments write it: groups, attributes, and datasets of numbers.

It supports the HDF5 library's default output: object headers of versions 1 and 2, symbol tables and compact links,
contiguous, compact and chunked layouts, and the filters deflate, shuffle and Fletcher's checksum. Other features are
errors. Every size in a header is checked against the file before memory is allocated. (Format: The HDF Group, "HDF5
File Format Specification", version 3.)"""

from __future__ import annotations

import math
import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, BinaryIO

import numpy as np

from ...base.strict import MOST_PACKED
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


SIGNATURE = b"\x89HDF\r\n\x1a\n"
_TEXT_MAX, _NAME_MAX = 1 << 16, 1 << 10
_DATASPACE, _LINK_INFO, _DATATYPE, _LINK, _LAYOUT, _FILTERS = 0x01, 0x02, 0x03, 0x06, 0x08, 0x0B
_ATTRIBUTE, _CONTINUATION, _SYMBOLS, _ATTRIBUTE_INFO = 0x0C, 0x10, 0x11, 0x15
_READ = (_DATASPACE, _LINK_INFO, _DATATYPE, _LINK, _LAYOUT, _FILTERS, _ATTRIBUTE, _SYMBOLS, _ATTRIBUTE_INFO)

Value = int | float | str | list[int | float]


class Hdf5File(Structures):
    """An open HDF5 file. Raises ValueError if it is another or an unsupported format."""

    def __init__(self, file: BinaryIO):
        super().__init__(file)
        if self.read(0, 8) != SIGNATURE:
            raise ValueError("no HDF5 file")
        (version,) = self.read(8, 1)
        if version in (0, 1):
            sizes, base = self.read(13, 2), 24 + 4 * version
            root = self.unpack("<Q", base + 40)
        elif version in (2, 3):
            sizes, base = self.read(9, 2), 12
            root = self.unpack("<Q", base + 24)
        else:
            raise ValueError(f"HDF5 superblock of version {version}")
        if sizes != b"\x08\x08" or self.unpack("<Q", base) != (0,):
            raise ValueError("HDF5 of other sizes of addresses, or behind other data")
        self.root = Node(self, root[0])


@dataclass(frozen=True)
class Node:
    """A group or a dataset."""

    file: Hdf5File
    address: int

    @cached_property
    def _messages(self) -> list[tuple[int, bytes]]:
        return list(_messages(self.file, self.address))

    def _message(self, kind: int) -> bytes | None:
        return next((data for found, data in self._messages if found == kind), None)

    @cached_property
    def attributes(self) -> dict[str, Value]:
        """The attributes that are numbers, texts or arrays of numbers, by name."""
        info = self._message(_ATTRIBUTE_INFO)
        if info and struct.unpack_from("<Q", info, 2 + 2 * (info[1] & 1))[0] != UNDEFINED:
            raise ValueError("HDF5 attributes in a heap of their own")
        found = (_attribute(self.file, data) for kind, data in self._messages if kind == _ATTRIBUTE)
        return {name: value for name, value in found if value is not None}

    @cached_property
    def members(self) -> dict[str, Node]:
        """The members of a group by name, in the file's order; empty for a dataset."""
        info = self._message(_LINK_INFO)
        if info and struct.unpack_from("<Q", info, 2 + 8 * (info[1] & 1))[0] != UNDEFINED:
            raise ValueError("HDF5 links in a heap of their own")
        links = [_link(data) for kind, data in self._messages if kind == _LINK]
        if symbols := self._message(_SYMBOLS):
            links += _symbols(self.file, *struct.unpack_from("<2Q", symbols))
        return {name: Node(self.file, address) for name, address in links if address is not None}

    @cached_property
    def dataset(self) -> Dataset | None:
        """The dataset; None for a group, and for values that are no numbers."""
        space, kind, layout = (self._message(each) for each in (_DATASPACE, _DATATYPE, _LAYOUT))
        if space is None or kind is None or layout is None:
            return None
        shape, number = shape_of(space), number_of(kind)
        if number is None or not shape or min(shape) < 1:
            return None
        return Dataset(self.file, shape, number, layout, filters_of(self._message(_FILTERS)))


def number_in(value: Value) -> float:
    """Convert an attribute's value to a number. Raises ValueError for a list or a text without a number."""
    if isinstance(value, list):
        raise ValueError("an HDF5 attribute of several numbers in place of one")
    return float(value)


def _messages(file: Hdf5File, address: int) -> Iterator[tuple[int, bytes]]:
    """Yield type and content of an object header's messages, except shared ones."""
    head = file.read(address, 16)
    if head[:4] == b"OHDR":
        flags = head[5]
        start = address + 6 + 16 * (flags >> 5 & 1) + 4 * (flags >> 4 & 1)
        width = 1 << (flags & 3)
        blocks = [(start + width, int.from_bytes(file.read(start, width), "little"))]
        form = struct.Struct("<BHB" + ("2x" if flags & 4 else ""))
    elif head[0] == 1:
        blocks, form = [(address + 16, struct.unpack_from("<I", head, 8)[0])], struct.Struct("<2HB3x")
    else:
        raise ValueError("no HDF5 object header")
    # Continuations extend the list during the loop. Circular ones run into the limit of structures.
    for start, size in blocks:
        block, at = file.read(start, size), 0
        while at + form.size <= len(block):
            kind, nbytes, flags = form.unpack_from(block, at)
            data = block[at + form.size : at + form.size + nbytes]
            at += form.size + nbytes
            if kind == _CONTINUATION:
                offset, length = struct.unpack_from("<2Q", data)
                # In version 2 a continuation starts with a signature and ends with a checksum.
                blocks.append((offset, length) if head[0] == 1 else (offset + 4, max(0, length - 8)))
            elif kind in _READ and not flags & 2:
                yield kind, data


def _symbols(file: Hdf5File, root: int, heap: int) -> Iterator[tuple[str, int | None]]:
    """Yield name and address of a group's members, from its symbol table and the heap of names."""
    signature, size, names = file.unpack("<4s4xQ8xQ", heap)
    if signature != b"HEAP":
        raise ValueError("no HDF5 heap")
    texts = file.read(names, size)
    for _, address in tree(file, root, kind=0, key=struct.Struct("<Q")):
        signature, count = file.unpack("<4s2xH", address)
        if signature != b"SNOD":
            raise ValueError("no HDF5 symbols")
        table = file.read(address + 8, 40 * count)
        for name, target, cached in struct.iter_unpack("<2QI20x", table):
            # A symbolic link has no address.
            yield _text(texts[name : name + _NAME_MAX]), target if cached != 2 else None


def _link(data: bytes) -> tuple[str, int | None]:
    """Read name and address of a link message; a soft link's address is None."""
    flags, at = data[1], 2
    is_hard = not (flags & 8 and data[at])
    at += (flags >> 3 & 1) + 8 * (flags >> 2 & 1) + (flags >> 4 & 1)
    width = 1 << (flags & 3)
    length = int.from_bytes(data[at : at + width], "little")
    name = data[at + width : at + width + length].decode("utf-8", "replace")
    return name, struct.unpack_from("<Q", data, at + width + length)[0] if is_hard else None


def _attribute(file: Hdf5File, data: bytes) -> tuple[str, Value | None]:
    """Read name and value of an attribute; None for an unsupported type."""
    version, flags, *sizes = struct.unpack_from("<2B3H", data)
    at, pieces = 8 + (version == 3), []
    for size in sizes:
        pieces.append(data[at : at + size])
        at += size + (-size % 8 if version == 1 else 0)
    name, kind, space = _text(pieces[0]), pieces[1], pieces[2]
    if version > 3 or (version > 1 and flags & 3):
        return name, None
    shape = shape_of(space)
    return name, _value(file, kind, math.prod(shape), data[at:]) if shape is not None else None


def _value(file: Hdf5File, kind: bytes, count: int, data: bytes) -> Value | None:
    """Decode a number, a text, or a list of numbers; None for an unsupported type."""
    number = number_of(kind)
    if number is not None:
        if count * number.itemsize > len(data):
            raise ValueError("an HDF5 attribute is cut")
        values = np.frombuffer(data, number, count)
        return values[0].item() if count == 1 else values.tolist()
    if count != 1:
        return None
    if kind[0] & 15 == 3:
        return _text(data[: struct.unpack_from("<I", kind, 4)[0]])
    if kind[0] & 15 == 9 and kind[1] & 15 == 1:
        length, address, index = struct.unpack_from("<IQI", data)
        return _text(_heap_object(file, address, index)[:length])
    return None


def _heap_object(file: Hdf5File, address: int, index: int) -> bytes:
    """Read an object of a global heap, which holds texts of variable length."""
    signature, size = file.unpack("<4s4xQ", address)
    if signature != b"GCOL":
        raise ValueError("no HDF5 heap")
    at, end = address + 16, address + size
    while at + 16 <= end:
        number, length = file.unpack("<H6xQ", at)
        if number == index:
            return file.read(at + 16, min(length, _TEXT_MAX))
        if number == 0:
            break
        at += 16 + length + -length % 8
    raise ValueError("an HDF5 text is missing")


def _text(data: bytes) -> str:
    return data.partition(b"\0")[0].decode("utf-8", "replace")
