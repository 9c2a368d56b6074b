# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of HDF5 as instruments write it: groups, attributes, and datasets of numbers.

It supports the HDF5 library's default output: object headers of versions 1 and 2, symbol tables and compact links,
contiguous, compact and chunked layouts, and the filters deflate, shuffle and Fletcher's checksum. Other features are
errors. (Format: The HDF Group, "HDF5 File Format Specification", version 3.)"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import BinaryIO

import numpy as np

from .hdf5_dataset import UNDEFINED, Dataset, Structures, filters_of, number_of, shape_of, tree

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
