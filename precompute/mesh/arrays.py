# SPDX-License-Identifier: GPL-3.0-or-later
"""Arrays out of NumPy's .npz files, which anyone may have written: of the kinds and shapes that are asked for, or
refused.

(Format: NumPy's reference, "numpy.lib.format". Its own reader believes what a header declares, and raises more kinds of
errors than it says.)
"""

import math
import re
import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..base.memory import refuse_beyond_memory
from ..base.strict_zip import Archive

# The farthest that a point may be from the origin, m. xatlas works in single precision, which must hold the squares of
# areas.
FARTHEST_M = 1e6
# The greatest size of all arrays of a file: some 40 million triangles.
_LARGEST = 1 << 31
# Of an array's kind of number ("f", "i", "u", "U" as NumPy has them, several where any will do) and its shape, where
# None is any length.
Wanted = tuple[str, tuple[int | None, ...]]
# The start of a member, with the length of its header by the format's major version.
_BEGINNING = b"\x93NUMPY"
_LENGTHS = {1: "<H", 2: "<I", 3: "<I"}
_HEADER_MAX = 1 << 14
_HEADER = re.compile(
    r"\{'descr': '([<>|=]?[iufU]\d{1,3})', 'fortran_order': (True|False), 'shape': \(((?:\d{1,10},? ?)*)\), \}\s*"
)


def read_arrays(path: Path, wanted: Mapping[str, Wanted]) -> dict[str, np.ndarray]:
    """Those of the wanted arrays that a file holds; others are not looked at. They cannot be written to.

    Raises OSError if the file cannot be read; ValueError, with the fault, if it is no such file or an array is not of
    its kind and shape; GratingError if the arrays do not fit into memory."""
    if path.exists() and not path.is_file():  # a fifo would be waited for
        raise ValueError("it is no file")
    with path.open("rb") as file:
        archive = Archive(file)
        names = {name: f"{name}.npy" for name in wanted if f"{name}.npy" in archive.names}
        total = sum(archive.size(member) for member in names.values())
        if total > _LARGEST:
            raise ValueError(f"more than {_LARGEST >> 30} GiB of arrays")
        refuse_beyond_memory(2 * total, "reading its arrays", "give a smaller mesh", source=path)
        return {name: _array(name, archive.read(member, _LARGEST), wanted[name]) for name, member in names.items()}


def _array(name: str, data: bytes, wanted: Wanted) -> np.ndarray:
    """An array from the bytes of its file."""
    form = _LENGTHS.get(data[6]) if data.startswith(_BEGINNING) and len(data) >= 12 else None
    if form is None:
        raise ValueError(f"{name} is no array")
    first = 8 + struct.calcsize(form)
    (length,) = struct.unpack_from(form, data, 8)
    header = _HEADER.fullmatch(data[first : first + min(length, _HEADER_MAX)].decode("latin-1"))
    if header is None:
        raise ValueError(f"{name} is no array of numbers")
    kinds, shape = wanted
    kind, sizes = np.dtype(header[1]), tuple(int(size) for size in re.findall(r"\d+", header[3]))
    fits = len(sizes) == len(shape) and all(want in (None, size) for size, want in zip(sizes, shape, strict=True))
    if kind.kind not in kinds or not fits:
        raise ValueError(f"{name} is of kind {kind} and shape {str(sizes):.60}")
    if math.prod(sizes) * kind.itemsize != len(data) - first - length:
        raise ValueError(f"{name} is not as long as its header says")
    array = np.frombuffer(data, kind, offset=first + length).reshape(sizes, order="F" if header[2] == "True" else "C")
    if kind.kind == "U":
        array.tolist()  # raises ValueError at what is no character
    return array
