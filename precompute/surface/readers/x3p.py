# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of X3P (ISO 25178-72): a zip archive of main.xml, which describes the axes, and a binary file of heights.

Heights are in metres, the first profile first. A bit field may mark the measured points; NaN and infinity are missing
points too. Small maps may be listed in main.xml instead."""

from __future__ import annotations

import re
from functools import partial
from typing import BinaryIO

import numpy as np

from ...base.strict_zip import Archive
from .channels import Channel
from .reader import KnownFault
from .scan_file import ScanReader, StoredMap
from .unread import CONVERT, archive_fault, first_member
from .x3p_xml import XML_MAX, Description

_BEGINNING = b"PK\x03\x04"
_KINDS = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}


def _described(archive: Archive) -> tuple[str, Description]:
    """Find main.xml and return its folder and description. Raises KnownFault if there is none."""
    names = [name for name in archive.names if re.search(r"(^|/)main\.xml$", name)]
    names = [name for name in names if not name.startswith("__MACOSX")]
    if not names:
        known = archive_fault(archive.names)
        raise KnownFault(*(known or ("a zip archive without main.xml, thus no X3P", CONVERT)))
    return names[0].removesuffix("main.xml"), Description(archive.read(names[0], XML_MAX))


def _maps(file: BinaryIO) -> list[StoredMap]:
    archive = Archive(file)
    folder, said = _described(archive)
    if {said.text(f"Record1/Axes/{axis}/AxisType", "I") for axis in ("CX", "CY")} != {"I"}:
        raise ValueError("its points do not lie on a grid")
    cols, rows, layers = (int(said.text(f"Record3/MatrixDimension/Size{axis}")) for axis in "XYZ")
    if min(rows, cols) < 1 or layers != 1:
        raise ValueError(f"{rows} x {cols} points in {layers} layers")
    dy, dx = (float(said.text(f"Record1/Axes/{axis}/Increment")) for axis in ("CY", "CX"))
    scale, offset = (
        float(said.text(f"Record1/Axes/CZ/{name}", default)) for name, default in (("Increment", "1"), ("Offset", "0"))
    )
    if said.values:
        if len(said.values) != rows * cols:
            raise ValueError(f"{rows} x {cols} points declared, and {len(said.values)} are there")
        load = partial(_listed, (rows, cols), (scale, offset), said)
    else:
        kind = _KINDS[said.text("Record1/Axes/CZ/DataType")]
        data = folder + said.text("Record3/DataLink/PointDataLink")
        valid = said.text("Record3/DataLink/ValidPointsLink", "")
        held = archive.size(data)
        if held != rows * cols * np.dtype(kind).itemsize:
            raise ValueError(f"{rows} x {cols} points declared, and {held} bytes are there")
        load = partial(_stored, (rows, cols), kind, (scale, offset), (data, valid and folder + valid))
    return [StoredMap(Channel("height", "", "m"), (rows, cols), (dy, dx), load)]


def _listed(shape: tuple[int, int], scaling: tuple[float, float], said: Description, file: BinaryIO) -> np.ndarray:
    """Return the points listed in main.xml."""
    return _scaled(np.frombuffer(said.values), scaling).reshape(shape)


def _stored(
    shape: tuple[int, int], kind: str, scaling: tuple[float, float], names: tuple[str, str], file: BinaryIO
) -> np.ndarray:
    """Read the points of the binary file; `names` are this file and the file of valid points, "" for none."""
    archive = Archive(file)
    count = shape[0] * shape[1]
    heights = _scaled(np.frombuffer(archive.read(names[0], archive.size(names[0])), kind, count), scaling)
    if names[1]:
        bits = np.frombuffer(archive.read(names[1], count // 8 + 1), np.uint8)
        heights[np.unpackbits(bits, bitorder="little", count=count) == 0] = np.nan
    return heights.reshape(shape)


def _scaled(values: np.ndarray, scaling: tuple[float, float]) -> np.ndarray:
    """Scale values by (factor, offset); infinite floats become NaN."""
    heights = values * np.float64(scaling[0])
    heights += scaling[1]
    if values.dtype.kind == "f":
        heights[np.isinf(values)] = np.nan
    return heights


def _begins(beginning: bytes) -> bool:
    return beginning.startswith(_BEGINNING) and archive_fault(first_member(beginning)) is None


X3P = ScanReader("X3P", (".x3p",), _begins, _maps)
