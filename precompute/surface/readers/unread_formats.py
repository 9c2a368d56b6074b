# SPDX-License-Identifier: GPL-3.0-or-later
"""Formats that are not read here: what a file is, and how to convert it.

They are recognised by their first bytes, archives by the names of their files, and tables by their lines."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Iterable

from .scan_file import CONVERT, decoded
from .text_tables import is_numbers, odd_words, with_points, words_among_numbers

_PICTURE = "its compression changes heights; export a grey PNG or TIFF of 16 bits"
_UNPACK = "unpack it and import the scan in it"
# Position of a format's first bytes, the bytes, the format, and the remedy.
_OTHERS: tuple[tuple[int, bytes, str, str], ...] = (
    (0, b"\x88\x1b\x03\x6f", "a Zygo MetroPro file", CONVERT),
    (0, b"\x88\x1b\x03\x70", "a Zygo MetroPro file", CONVERT),
    (0, b"\x88\x1b\x03\x71", "a Zygo MetroPro file", CONVERT),
    (0, b"\x01\x00Directory", "a Wyko OPD file", CONVERT),
    (0, b"VK4_", "a Keyence VK4 file", CONVERT),
    (0, b"AliconaImaging\0", "an Alicona file", CONVERT),
    (0, b"ONTMATRX0101", "an Omicron MATRIX file", CONVERT),
    (0, b"[Parameter]", "a Createc file", CONVERT),
    (0, b"[Paramet32]", "a Createc file", CONVERT),
    (0, b"[Paramco32]", "a Createc file", CONVERT),
    (0, b"VCA DATA\x01\x00\x00\x55", "a Dektak .opdx file", CONVERT),
    (2, "STiMage 00".encode("utf-16-le"), "an RHK file", CONVERT),
    (0, b"ISO/TC 201 SPM data transfer format", "an ISO 28600 file", CONVERT),
    (0, b"CDF\x01", "a NetCDF file", CONVERT),
    (0, b"\x89HDF\r\n\x1a\n", "an HDF5 file", CONVERT),
    (0, b"MATLAB 5.0 MAT-file", "a MATLAB file", "save the matrix of heights by writematrix, as .csv"),
    (0, b"\xff\xd8\xff", "a JPEG picture", _PICTURE),
    (0, b"GIF8", "a GIF picture", _PICTURE),
    (8, b"WEBP", "a WebP picture", _PICTURE),
    (0, b"8BPS", "a Photoshop picture", "export a grey PNG or TIFF of 16 bits"),
    (0, b"%PDF", "a PDF document", "export the heights themselves"),
    (0, b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an older Office document", "export the sheet of heights as .csv"),
    (0, b"\x1f\x8b", "a packed file (gzip)", _UNPACK),
    (0, b"7z\xbc\xaf\x27\x1c", "a packed file (7z)", _UNPACK),
    (0, b"Rar!", "a packed file (RAR)", _UNPACK),
    (0, b"\xfd7zXZ", "a packed file (xz)", _UNPACK),
)
# A file name that identifies an archive, the archive, and the remedy.
_ARCHIVES: tuple[tuple[str, str, str], ...] = (
    ("[Content_Types].xml", "an Office document", "export the sheet of heights as .csv"),
    ("mimetype", "an OpenDocument file", "export the sheet of heights as .csv"),
    ("header.properties", "a JPK archive of force curves, without an image", "export the scan as .jpk"),
    ("index.xml", "an archive of a profiler, as Sensofar's .plux", CONVERT),
)
# Header bytes of an Igor wave by version. Their 16-bit words add up to zero modulo 2^16.
_IGOR_HEADS = {1: 118, 2: 126, 3: 130}
# The fewest lines of a table with the same count of numbers.
_TABLE_LINES = 3
_ZIP_BEGINNING, _ZIP_NAME_AT = b"PK\x03\x04", 30


def known_fault(beginning: bytes) -> tuple[str, str] | None:
    """Identify an unsupported file by its first bytes: what it is and the remedy, or None."""
    for at, magic, what, remedy in _OTHERS:
        if beginning.startswith(magic, at):
            return f"{what}, which is not read here", remedy
    return archive_fault(first_member(beginning)) or _igor_fault(beginning) or _table_fault(beginning)


def first_member(beginning: bytes) -> list[str]:
    """Return the name of the first file in a zip archive with these first bytes; [] if it is not an archive."""
    if not beginning.startswith(_ZIP_BEGINNING) or len(beginning) < _ZIP_NAME_AT:
        return []
    (length,) = struct.unpack_from("<H", beginning, 26)
    return [decoded(beginning[_ZIP_NAME_AT : _ZIP_NAME_AT + length])]


def archive_fault(names: Iterable[str]) -> tuple[str, str] | None:
    """Identify an archive by its file names, as `known_fault` does."""
    held = set(names)
    for name, what, remedy in _ARCHIVES:
        if name in held:
            return what, remedy
    if any(name.endswith(".npy") for name in held):
        return "an archive of NumPy arrays", "save one array as .npy"
    return None


def _igor_fault(beginning: bytes) -> tuple[str, str] | None:
    """Identify an Igor wave of an older version, which holds one curve."""
    for order in "<>":
        (version,) = struct.unpack_from(f"{order}h", beginning) if len(beginning) >= 2 else (0,)
        size = _IGOR_HEADS.get(version, 0)
        if 0 < size <= len(beginning) and sum(struct.unpack_from(f"{order}{size // 2}h", beginning)) & 0xFFFF == 0:
            fault = f"an Igor wave of version {version}, which holds one curve"
            return fault, "save the map as a wave of two dimensions"
    return None


def _table_fault(beginning: bytes) -> tuple[str, str] | None:
    """Identify a text with numbers under a heading that is not marked as a comment, or with words among the numbers."""
    if b"\0" in beginning:
        return None
    # The last line may be cut.
    lines = [line for line in decoded(beginning).splitlines()[:-1] if line.strip() and not line.startswith("#")]
    are_numbers = [is_numbers(line.encode()) for line in lines]
    counts = Counter(len(with_points(line).split()) for line, found in zip(lines, are_numbers, strict=True) if found)
    if not counts:
        return None
    columns, count = counts.most_common(1)[0]
    if count < _TABLE_LINES:
        return None
    first = are_numbers.index(True)
    marked = "put a # before each line of the heading"
    for line, found in zip(lines[first:], are_numbers[first:], strict=True):
        if not found and (words := odd_words(line)):
            fault, remedy = words_among_numbers(words)
            return fault, f"{remedy}, and {marked}" if first else remedy
    if columns < 3:
        return f"a text of {columns} columns under a heading, such as a profile", "export the whole map"
    return f"a text of {columns} columns under a heading", marked
