# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of NumPy .npy: an array (rows, cols) of numbers, row 0 the scan's top. It never reads pickled objects.

(Format: NumPy's reference, "numpy.lib.format". NumPy's own header parser raises undocumented exceptions.)"""

from __future__ import annotations

import re
import struct
from typing import BinaryIO

from .numbers_file import Judge, Numbers, NumbersReader
from .scan_file import Block, read_exactly

_BEGINNING = b"\x93NUMPY"
# The type of the header's length, by the format's major version.
_LENGTHS = {1: "<H", 2: "<I", 3: "<I"}
_HEADER_MAX = 1 << 14
_KIND = re.compile(r"'descr': *'([<>|=]?(?:[iu][1248]|f[248]|b1))'")
_SHAPE = re.compile(r"'shape': *\((\d{1,10})L?, *(\d{1,10})L?,?\)")
_BY_COLUMNS = re.compile(r"'fortran_order': *True")


def _load(file: BinaryIO, judge: Judge) -> Numbers:
    form = _LENGTHS[read_exactly(file, 0, 8)[6]]
    first = 8 + struct.calcsize(form)
    (length,) = struct.unpack(form, read_exactly(file, 8, first - 8))
    if length > _HEADER_MAX:
        raise ValueError(f"a header of {length} bytes")
    header = read_exactly(file, first, length).decode("latin-1")
    kind, shape = _KIND.search(header), _SHAPE.search(header)
    if kind is None or shape is None:
        raise ValueError("no matrix of numbers")
    rows, cols = int(shape[1]), int(shape[2])
    judge((rows, cols))
    by_columns = _BY_COLUMNS.search(header) is not None
    values = Block(first + length, (cols, rows) if by_columns else (rows, cols), kind[1]).within(file).read(file)
    return Numbers(values.T if by_columns else values)


def _begins(beginning: bytes) -> bool:
    return beginning.startswith(_BEGINNING)


NPY = NumbersReader("NumPy", (".npy",), _begins, _load)
