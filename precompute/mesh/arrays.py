# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads arrays of known kinds and shapes from untrusted .npz files of NumPy.

Format: NumPy's reference, "numpy.lib.format". NumPy's own reader trusts the header and raises undocumented errors.
"""

import math
import re
import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..base.files import is_no_file
from ..base.memory import refuse_beyond_memory
from ..base.strict_zip import Archive

# The greatest distance of a point from the origin, in metres: xatlas squares areas in single precision.
FARTHEST_M = 1e6
# The greatest total size of a file's arrays, in bytes: about 40 million triangles.
_LARGEST = 1 << 31
# NumPy's letters for the allowed kinds of number ("f", "i", "u", "U"), and the shape, where None is any length.
Wanted = tuple[str, tuple[int | None, ...]]
# The magic bytes of an .npy file, and the format of the header's length for each major version.
_BEGINNING = b"\x93NUMPY"
_LENGTHS = {1: "<H", 2: "<I", 3: "<I"}
_HEADER_MAX = 1 << 14
_HEADER = re.compile(
    r"\{'descr': '([<>|=]?[iufU]\d{1,3})', 'fortran_order': (True|False), 'shape': \(((?:\d{1,10},? ?)*)\), \}\s*"
)


def read_arrays(path: Path, wanted: Mapping[str, Wanted]) -> dict[str, np.ndarray]:
    """Read the wanted arrays that a file holds; other arrays are ignored. The arrays are read-only.

    Raises OSError if the file cannot be read; ValueError, with the fault, if it is no .npz file or an array has another
    kind or shape; GratingError if the arrays do not fit into memory."""
    if is_no_file(path):
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
    """Decode the array in the bytes of an .npy file."""
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
        array.tolist()  # raises ValueError at an invalid character
    return array
