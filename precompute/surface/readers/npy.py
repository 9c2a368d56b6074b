# SPDX-License-Identifier: GPL-3.0-or-later
"""NumPy .npy: an array (rows, cols) of numbers, row 0 the scan's top. Pickled objects are never read."""

from __future__ import annotations

import os
from typing import BinaryIO

import numpy as np

from .given_size import Numbers, NumbersReader

_BEGINNING = b"\x93NUMPY"
_KINDS = "buif"


def _load(file: BinaryIO) -> Numbers:
    readers = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    shape, by_columns, kind = readers[np.lib.format.read_magic(file)](file)
    if kind.kind not in _KINDS or len(shape) != 2 or min(shape) < 1:
        raise ValueError(f"an array of {kind} of shape {shape}, and no matrix of numbers")
    start = file.tell()
    held = file.seek(0, os.SEEK_END) - start
    if shape[0] * shape[1] * kind.itemsize > held:
        raise ValueError(f"{shape[0]} x {shape[1]} numbers declared, and {held} bytes are there")
    file.seek(start)
    values = np.fromfile(file, kind, shape[0] * shape[1])
    return Numbers(values.reshape(shape[::-1]).T if by_columns else values.reshape(shape))


def _begins(beginning: bytes) -> bool:
    return beginning.startswith(_BEGINNING)


NPY = NumbersReader("NumPy", (".npy",), _begins, _load)
