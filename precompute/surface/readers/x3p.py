# SPDX-License-Identifier: GPL-3.0-or-later
"""X3P of ISO 25178-72: a zip archive of main.xml, which describes the axes, and of the heights as one binary file.

Heights are in metres, the first profile first. A bit field may tell which points were measured.
"""

from __future__ import annotations

import io
import re
from functools import partial
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from .channels import Channel
from .scan_file import OtherFormat, ScanReader, StoredMap
from .unread import CONVERT, archive_fault, first_member

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element
    from zipfile import ZipFile

_BEGINNING = b"PK\x03\x04"
_KINDS = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}
_XML_MAX, _NAMES_MAX = 1 << 20, 10_000
# Deflate packs at most this many bytes into one.
_MOST_PACKED = 1032


def _archive(file: BinaryIO) -> ZipFile:
    """The archive. Raises ValueError where it is none, or one of others than X3P."""
    from zipfile import BadZipFile, ZipFile

    try:
        archive = ZipFile(file)
    except (BadZipFile, NotImplementedError) as error:
        raise ValueError(str(error)) from error
    if len(archive.namelist()) > _NAMES_MAX:
        raise ValueError(f"an archive of more than {_NAMES_MAX} files")
    return archive


def _held(archive: ZipFile, name: str, most: int) -> bytes:
    """A file of the archive of at most `most` bytes. Raises ValueError where it is longer or damaged."""
    from zipfile import BadZipFile

    info = archive.getinfo(name)
    if info.file_size > min(most, _MOST_PACKED * info.compress_size + _MOST_PACKED):
        raise ValueError(f"{name} has {info.file_size} bytes")
    try:
        with archive.open(info) as member:
            data = member.read(most + 1)
    except (BadZipFile, NotImplementedError, RuntimeError, OSError) as error:
        raise ValueError(str(error)) from error
    if len(data) > most:
        raise ValueError(f"{name} is longer than it says")
    return data


def _described(archive: ZipFile) -> tuple[str, Element]:
    """The folder of main.xml in the archive, and its root. Raises ValueError where there is none."""
    from xml.etree import ElementTree

    names = [name for name in archive.namelist() if re.search(r"(^|/)main\.xml$", name)]
    names = [name for name in names if not name.startswith("__MACOSX")]
    if not names:
        fault = archive_fault(archive.namelist())
        raise OtherFormat(fault or f"a zip archive without main.xml, thus no X3P; {CONVERT}")
    text = _held(archive, names[0], _XML_MAX)
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
        raise ValueError("main.xml declares entities")
    try:
        root = ElementTree.parse(io.BytesIO(text)).getroot()
    except ElementTree.ParseError as error:
        raise ValueError(f"main.xml: {error}") from error
    return names[0].removesuffix("main.xml"), root


def _text(root: Element, path: str, otherwise: str | None = None) -> str:
    """The text of the element at a path of names, whatever their namespaces. Raises KeyError where it is missing."""
    found = root.find("/".join(f"{{*}}{name}" for name in path.split("/")))
    text = "" if found is None else (found.text or "").strip()
    if not text and otherwise is None:
        raise KeyError(path)
    return text or otherwise


def _maps(file: BinaryIO) -> list[StoredMap]:
    archive = _archive(file)
    folder, root = _described(archive)
    if {_text(root, f"Record1/Axes/{axis}/AxisType", "I") for axis in ("CX", "CY")} != {"I"}:
        raise ValueError("its points do not lie on a grid")
    cols, rows, layers = (int(_text(root, f"Record3/MatrixDimension/Size{axis}")) for axis in "XYZ")
    if min(rows, cols) < 1 or layers != 1:
        raise ValueError(f"{rows} x {cols} points in {layers} layers")
    pixel = tuple(float(_text(root, f"Record1/Axes/{axis}/Increment")) for axis in ("CY", "CX"))
    kind = _KINDS[_text(root, "Record1/Axes/CZ/DataType")]
    scale, offset = (
        float(_text(root, f"Record1/Axes/CZ/{name}", default))
        for name, default in (("Increment", "1"), ("Offset", "0"))
    )
    data = folder + _text(root, "Record3/DataLink/PointDataLink")
    valid = _text(root, "Record3/DataLink/ValidPointsLink", "")
    needed = rows * cols * np.dtype(kind).itemsize
    if archive.getinfo(data).file_size != needed:
        raise ValueError(f"{rows} x {cols} points declared, and {archive.getinfo(data).file_size} bytes are there")
    load = partial(_heights, (rows, cols), kind, (scale, offset), (data, valid and folder + valid))
    return [StoredMap(Channel("height", "", "m"), (rows, cols), pixel, load)]


def _heights(
    shape: tuple[int, int], kind: str, scaling: tuple[float, float], names: tuple[str, str], file: BinaryIO
) -> np.ndarray:
    archive = _archive(file)
    count = shape[0] * shape[1]
    stored = np.frombuffer(_held(archive, names[0], count * np.dtype(kind).itemsize), kind, count)
    heights = stored * np.float64(scaling[0])
    heights += scaling[1]
    if names[1]:
        bits = np.frombuffer(_held(archive, names[1], count // 8 + 1), np.uint8)
        heights[np.unpackbits(bits, bitorder="little", count=count) == 0] = np.nan
    return heights.reshape(shape)


def _begins(beginning: bytes) -> bool:
    return beginning.startswith(_BEGINNING) and archive_fault(first_member(beginning)) is None


X3P = ScanReader("X3P", (".x3p",), _begins, _maps)
