# SPDX-License-Identifier: GPL-3.0-or-later
"""Readers of ISO 25178's files. A surface data file .sdf (part 71), text or binary, has a header in metres and then
heights by profile. X3P (part 72) is a zip archive of main.xml, which describes the axes, and a file of heights.

X3P's heights are in metres, the first profile first. A bit field may mark the measured points; NaN and infinity are
missing points too. Small maps may be listed in main.xml instead. Its parser refuses entities, which could multiply a
text's length, and keeps only the needed elements."""

from __future__ import annotations

import re
import struct
from array import array
from functools import partial
from typing import BinaryIO

import numpy as np

from ...base.strict import Archive
from .scan_file import (
    CONVERT,
    Block,
    Channel,
    KnownFault,
    ScanReader,
    StoredMap,
    read_exactly,
)
from .text_tables import numbers_of, read_text
from .unread_formats import archive_fault, first_member

_TEXT, _BINARY = (b"aISO-1.0", b"aBCR-1.0"), (b"bISO-1.0", b"bBCR-1.0")
_HEAD = struct.Struct("<8s10s12s12s2H4d3B")
_HEAD_NAMES = ("NumPoints", "NumProfiles", "Xscale", "Yscale", "Zscale", "Zresolution", "Compression", "DataType")
_SDF_KINDS = {0: "<u1", 1: "<u2", 2: "<u4", 3: "<f4", 4: "<i1", 5: "<i2", 6: "<i4", 7: "<f8"}
# The integer of an unmeasured point, by number type.
_MISSING = {1: 2**16 - 1, 2: 2**32 - 1, 5: -(2**15), 6: -(2**31)}
# The float of an unmeasured point is NaN or the largest float. Texts may round it, even to infinity.
_LARGEST = {3: 0.999 * np.finfo("f4").max, 7: 0.999 * np.finfo("f8").max}


def _sdf_maps(file: BinaryIO) -> list[StoredMap]:
    file.seek(0)
    if file.read(len(_BINARY[0])) in _BINARY:
        found = _HEAD.unpack(read_exactly(file, 0, _HEAD.size))
        facts, body = dict(zip(_HEAD_NAMES, found[4:], strict=False)), ""
    else:
        head, _, rest = read_text(file).partition("*")
        pairs = (line.partition("=") for line in head.splitlines()[1:])
        entries = {key.strip(): value.strip() for key, _, value in pairs}
        facts, body = {name: float(entries.get(name, "0")) for name in _HEAD_NAMES}, rest.partition("*")[0]
    shape, kind = (int(facts["NumProfiles"]), int(facts["NumPoints"])), int(facts["DataType"])
    if facts["Compression"] or kind not in _SDF_KINDS:
        raise ValueError(f"compression {facts['Compression']:g}, numbers of type {kind}")
    if body:
        load = partial(_from_text, body, shape, facts["Zscale"], kind)
    else:
        load = partial(_from_block, Block(_HEAD.size, shape, _SDF_KINDS[kind]).within(file), facts["Zscale"], kind)
    return [StoredMap(Channel("height", "", "m"), shape, (float(facts["Yscale"]), float(facts["Xscale"])), load)]


def _from_text(body: str, shape: tuple[int, int], scale: float, kind: int, file: BinaryIO) -> np.ndarray:
    return _heights(numbers_of(body.replace("BAD", "nan")).reshape(shape), scale, kind)


def _from_block(block: Block, scale: float, kind: int, file: BinaryIO) -> np.ndarray:
    return _heights(block.read(file), scale, kind)


def _heights(stored: np.ndarray, scale: float, kind: int) -> np.ndarray:
    """Convert stored numbers to heights, NaN for unmeasured points."""
    heights = stored * np.float64(scale)
    if kind in _MISSING:
        heights[stored == _MISSING[kind]] = np.nan
    if kind in _LARGEST:
        heights[np.abs(stored) >= _LARGEST[kind]] = np.nan
    return heights


def _begins_as_sdf(beginning: bytes) -> bool:
    return beginning.startswith(_TEXT + _BINARY)


SDF = ScanReader("ISO 25178 SDF", (".sdf",), _begins_as_sdf, _sdf_maps)


# The longest main.xml in bytes, and the most elements, enough for a map of 1024 x 1024 points.
XML_MAX, _ELEMENTS_MAX = 64 << 20, (1 << 20) + 10_000
_DEPTH_MAX = 32
_AXES = ("AxisType", "DataType", "Increment", "Offset")
# The paths of the needed elements, without the root's name.
_KEPT = frozenset(
    [("Record1", "Axes", axis, name) for axis in ("CX", "CY", "CZ") for name in _AXES]
    + [("Record3", "MatrixDimension", f"Size{axis}") for axis in "XYZ"]
    + [("Record3", "DataLink", name) for name in ("PointDataLink", "ValidPointsLink")]
)
_DATUM = ("Record3", "DataList", "Datum")


class Description:
    """The texts of main.xml by path, without namespaces, and the last number of each Datum.

    values  the numbers; NaN for an empty Datum, a point that was not measured"""

    def __init__(self, xml: bytes) -> None:
        """Parse main.xml. Raises ValueError if it is damaged, too deep, has too many elements or declares entities."""
        from xml.etree.ElementTree import ParseError, XMLParser

        self.values = array("d")
        self._texts: dict[tuple[str, ...], str] = {}
        self._path: list[str] = []
        self._pieces: list[str] = []
        self._elements = 0
        parser = XMLParser(target=self)
        try:
            parser.feed(xml)
            parser.close()
        except ParseError as error:
            raise ValueError(f"main.xml: {error}") from error

    def text(self, path: str, otherwise: str | None = None) -> str:
        """Return the text of the first element at a path, such as "Record1/Axes/CX/Increment", or `otherwise`.

        Raises KeyError if both are missing."""
        found = self._texts.get(tuple(path.split("/"))) or otherwise
        if found is None:
            raise KeyError(path)
        return found

    # Callbacks of the parser.

    def doctype(self, name: str, public: str | None, system: str | None) -> None:
        raise ValueError("main.xml declares entities")

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self._path.append(tag.rpartition("}")[2])
        self._elements += 1
        if len(self._path) > _DEPTH_MAX or self._elements > _ELEMENTS_MAX:
            raise ValueError(f"main.xml nests too deep, or has more than {_ELEMENTS_MAX} elements")
        self._pieces.clear()

    def data(self, text: str) -> None:
        self._pieces.append(text)

    def end(self, tag: str) -> None:
        path = tuple(self._path[1:])
        if path == _DATUM:
            self.values.append(float("".join(self._pieces).rpartition(";")[2].strip() or "nan"))
        elif path in _KEPT:
            self._texts.setdefault(path, "".join(self._pieces).strip())
        self._path.pop()
        self._pieces.clear()

    def close(self) -> None:
        pass


_BEGINNING = b"PK\x03\x04"
_KINDS = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}


def _described(archive: Archive) -> tuple[str, Description]:
    """Find main.xml and return its folder and description. Raises KnownFault if there is none."""
    names = [name for name in archive.names if re.search(r"(^|/)main\.xml$", name)]
    names = [name for name in names if not name.startswith("__MACOSX")]
    if not names:
        known = archive_fault(archive.names)
        raise KnownFault(*(known or ("a zip archive without main.xml, so not an X3P file", CONVERT)))
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
