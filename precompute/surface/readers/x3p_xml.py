# SPDX-License-Identifier: GPL-3.0-or-later
"""Parser of an X3P's main.xml: the axes, the links to the data, and the points if they are listed in it.

It refuses entities, which could multiply a text's length, and keeps only the needed elements."""

from __future__ import annotations

from array import array

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
