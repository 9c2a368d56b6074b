# SPDX-License-Identifier: GPL-3.0-or-later
"""What all readers of files share: their protocol, the choice of channel, units, numbers as text, and refusals.

ScanReader is the common reader of instrument files; a format supplies the maps of a file and how to read them. A new
format needs a module with a reader, and a line in READERS of reader_registry.py. Blender loads the registry at
startup, so a reader imports its decoder (Pillow) only in the functions that decode.

Numbers as text are separated by blanks, tabs, semicolons or commas. They have decimal points or commas, and may be
quoted. An error for an unsupported format says how to convert it. Such formats are recognised by their first bytes,
archives by the names of their files, and tables by their lines."""

from __future__ import annotations

import math
import os
import re
import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import BinaryIO, Protocol, runtime_checkable

import numpy as np

from ...base.failure import GratingError, Setting, Words
from ...base.machine import refuse_beyond_memory
from ..height_map import HeightMap
from .given_size import sized

# Names of the topography, in order of preference.
_TOPOGRAPHY = ("z-axis", "topography", "height", "z height", "zsensor", "z-axissensor")
# Names that must match as a whole.
_WHOLE_NAMES = ("z",)
# Quantities that some instruments give in metres, but that are never chosen automatically.
_NO_TOPOGRAPHY = ("amplitude", "phase", "deflection", "error", "friction", "distance")
# The retrace of a line, chosen only if there is no trace.
_WAY_BACK = ("retrace", "backward")
# The words for the two scan directions, backward and forward.
_WAYS = tuple(zip(_WAY_BACK, ("trace", "forward"), strict=True))
# The most characters of a file's text that a message quotes, and the most channels that it lists or explains.
_QUOTED, _LISTED, _EXPLAINED = 80, 20, 5


def shortened(text: object) -> str:
    """Prepare text from a file for messages and labels: blanks for unprintable characters, at most _QUOTED in all."""
    printed = "".join(character if character.isprintable() else " " for character in str(text)[: _QUOTED + 1])
    return printed if len(printed) <= _QUOTED else f"{printed[: _QUOTED - 3]}..."


def unit_over(unit: str, across: str) -> str:
    """Return the unit of a channel whose sides are in `across`: "m" only over metres, "" if both are missing."""
    if across == "m":
        return unit
    return f"{unit or 'no unit'} over {across or 'no unit'}" if unit or across else ""


@dataclass(frozen=True)
class Channel:
    """One map of values in a file.

    name      the quantity: "Z-Axis"
    frame     the scan among several of the quantity: "forward"; else ""
    unit      unit of the values; "m" for heights
    is_image  whether the values cover a plane in metres; False for force curves"""

    name: str
    frame: str
    unit: str
    is_image: bool = True

    @property
    def label(self) -> str:
        """Name and frame as users see and type them: "Z-Axis forward"."""
        return shortened(f"{self.name} {self.frame}").strip()

    @property
    def is_surface(self) -> bool:
        """Whether the values are heights over a plane."""
        return self.is_image and self.unit == "m"


def choose_channel(source: str, channels: Sequence[Channel], wanted: str | None) -> int:
    """Return the index of the channel whose label is, or begins with, `wanted` in any case; None is the topography.

    `source` names the file in messages. Raises GratingError if there is no such channel, if its values are no heights
    over a plane, or if the file holds only curves."""
    if channels and not any(channel.is_image for channel in channels):
        raise GratingError(
            source, "holds curves, such as force curves, but no image", "export the topography scan of the same place"
        )
    surfaces = [channel for channel in channels if channel.is_surface]
    if wanted is None:
        # A single channel that is no surface: its own fault is the best message.
        found = 0 if len(channels) == 1 and not surfaces else _topography(channels)
    else:
        found = _labelled(channels, wanted)
    if found is None and wanted is None and surfaces:
        remedy = ("name one by ", Setting.CHANNEL, f": {_list(surfaces)}")
        raise GratingError(source, "it is unclear which channel is the topography", remedy)
    if found is None and wanted is None:
        faults = ", ".join(f"'{channel.label}' {_fault_of(channel)}" for channel in channels[:_EXPLAINED])
        raise GratingError(source, f"no channel holds heights ({faults or 'there is none'})", _other_than(surfaces))
    if found is None:
        raise GratingError(source, f"has no channel '{shortened(wanted)}'", f"name one of: {_list(channels)}")
    chosen = channels[found]
    if not chosen.is_surface:
        raise GratingError(source, f"channel '{chosen.label}' {_fault_of(chosen)}", _other_than(surfaces))
    return found


def other_way(label: str, labels: Sequence[str]) -> str | None:
    """Find the label of the same quantity's opposite scan direction: "Height retrace" for "Height trace", "Z-Axis
    forward" for "Z-Axis backward". None if there is none. Gwyddion files join the words: "HeightTrace"."""
    for words in _WAYS:
        # "retrace" ends with "trace".
        old, new = words if words[0] in label.casefold() else words[::-1]
        head, found, tail = label.casefold().rpartition(old)
        if found:
            return next((each for each in labels if each.casefold() == head + new + tail), None)
    return None


def _fault_of(channel: Channel) -> str:
    """Explain why a channel's values are no heights."""
    if not channel.is_image:
        return "holds curves, not an image"
    if not channel.unit:
        return "has no unit of height"
    return f"is in '{shortened(channel.unit)}', not in metres"


def _other_than(surfaces: Sequence[Channel]) -> Words:
    """Return the remedy if the requested channel is no surface."""
    if surfaces:
        return "name a height channel with ", Setting.CHANNEL, f", of: {_list(surfaces)}"
    return (
        "export the height channel, or give it its units in Gwyddion (Data Process, Basic Operations, Dimensions and "
        "Units) and save it as .gwy"
    )


def _list(channels: Sequence[Channel]) -> str:
    """List the channels' labels for a message."""
    named = ", ".join(f"'{channel.label}'" for channel in channels[:_LISTED])
    more = f" and {len(channels) - _LISTED} more" if len(channels) > _LISTED else ""
    return f"{named}{more}" or "none"


def _labelled(channels: Sequence[Channel], wanted: str) -> int | None:
    labels = [channel.label.casefold() for channel in channels]
    wanted = wanted.casefold()
    exact = (i for i, label in enumerate(labels) if label == wanted)
    begun = (i for i, label in enumerate(labels) if label.startswith(wanted))
    return next(exact, next(begun, None))


def _topography(channels: Sequence[Channel]) -> int | None:
    """Find the clear topography channel: trace before retrace, then by name."""
    surfaces = [(i, channel.name.casefold()) for i, channel in enumerate(channels) if _may_be_topography(channel)]
    forth = [(i, name) for i, name in surfaces if not channels[i].frame.casefold().startswith(_WAY_BACK)]
    for found in (forth, surfaces):
        exact = (i for known in (*_TOPOGRAPHY, *_WHOLE_NAMES) for i, name in found if name == known)
        begun = (i for known in _TOPOGRAPHY for i, name in found if name.startswith(known))
        if (first := next(exact, next(begun, None))) is not None:
            return first
    return surfaces[0][0] if len(surfaces) == 1 else None


def _may_be_topography(channel: Channel) -> bool:
    return channel.is_surface and not any(word in channel.name.casefold() for word in _NO_TOPOGRAPHY)


# The bytes from a file's start that `can_read` gets. They hold a TIFF's tags and a text's first rows.
BEGINNING_BYTES = 4096


class KnownFault(Exception):
    """Raised for a file whose fault is known, such as another format with the same first bytes, with the remedy."""

    def __init__(self, fault: str, remedy: str) -> None:
        super().__init__(fault, remedy)
        self.fault, self.remedy = fault, remedy


@runtime_checkable
class Reader(Protocol):
    """A reader of one file format.

    name        name of the format in messages: "Gwyddion"
    extensions  lower-case file extensions, the usual one first: (".tif", ".tiff")
    needs_size  True for pictures: they hold one map, without its width and the height of white over black. False for
                instrument files: they hold both sizes, and may hold several channels"""

    @property
    def name(self) -> str: ...

    @property
    def extensions(self) -> tuple[str, ...]: ...

    @property
    def needs_size(self) -> bool: ...

    def can_read(self, beginning: bytes) -> bool:
        """Whether a file is of this format, by its first bytes (at most BEGINNING_BYTES)."""
        ...

    def channels(self, source: str) -> tuple[Channel, ...]:
        """List the channels in the file's order, without reading heights; () for a picture.

        Raises GratingError if the file is damaged, OSError if it cannot be opened."""
        ...

    def read(
        self,
        source: str,
        *,
        size_um: float | None = None,
        height_nm: float | None = None,
        channel: str | None = None,
    ) -> HeightMap:
        """Read a file as measured: not levelled, NaN for missing pixels.

        A reader that needs sizes ignores `channel`. Other readers ignore `height_nm`, take `size_um` in place of the
        file's own width, and read the topography if `channel` is None. Raises GratingError if the file is damaged or a
        value is missing, OSError if the file cannot be opened."""
        ...


_PREFIXES = {"": 1.0, "m": 1e-3, "u": 1e-6, "n": 1e-9, "p": 1e-12, "f": 1e-15, "c": 1e-2, "k": 1e3}
# The micro sign, the Greek letter, the sign in the DOS code page 850, and what NanoScope writes.
_MICRO = str.maketrans({"\u00b5": "u", "\u03bc": "u", "\u00e6": "u", "~": "u"})
_ANGSTROM = ("\u00c5", "\u212b", "Ang", "Angstrom")
_METRES = ("m", "meter", "metre")


def in_base_units(unit: str) -> tuple[float, str]:
    """Return a unit's size and its base unit: (1e-9, "m") for "nm", (1e-3, "V") for "mV", (1, "deg") for "deg"."""
    unit = unit.strip()
    if unit in _ANGSTROM:
        return 1e-10, "m"
    if unit in _METRES:
        return 1.0, "m"
    plain = unit.translate(_MICRO)
    if len(plain) == 2 and plain[0] in _PREFIXES and plain[1] in ("m", "V", "A", "N", "W", "s"):
        return _PREFIXES[plain[0]], plain[1]
    return 1.0, unit


def in_metres(text: str) -> float:
    """Convert a length with its unit to metres: "12,34 \u00b5m" is 1.234e-5. Raises ValueError if it is no length."""
    number, _, unit = text.strip().partition(" ")
    size, base = in_base_units(unit)
    if base != "m":
        raise ValueError(f"'{text.strip()}' is not a length")
    return float(number.replace(",", ".")) * size


# The longest text in bytes, and the most numbers in it. 2048 x 2048 numbers take seconds.
_TEXT_MAX, _NUMBERS_MAX = 64 << 20, 1 << 23
_SEPARATORS = (b" ", b"\n", b"\r", b"\t", b";", b",")
# A fault and its remedy.
AXES = "its first row and column are axes, no heights", "delete the first row and the first column"
_NUMBER = re.compile(r"[-+]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+]?\d+)?|[-+]?nan", re.IGNORECASE)


def read_text(file: BinaryIO) -> str:
    """Read a file as UTF-8 or else Latin-1. Raises ValueError if it is too long or holds zero bytes."""
    file.seek(0)
    data = file.read(_TEXT_MAX + 1)
    if len(data) > _TEXT_MAX:
        raise ValueError(f"a text of more than {_TEXT_MAX >> 20} MiB; save it as a binary file")
    if b"\0" in data:
        raise ValueError("a text with zero bytes")
    # Repeated separators count too, which also rejects a long text of blanks.
    if sum(map(data.count, _SEPARATORS)) > _NUMBERS_MAX:
        raise ValueError(f"a text of more than {_NUMBERS_MAX} numbers; save it as a binary file")
    return decoded(data)


def decoded(data: bytes) -> str:
    """Decode bytes as UTF-8 or else Latin-1."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def numbers_of(text: str) -> np.ndarray:
    """Parse all numbers of a text into a flat array. Raises ValueError for anything else."""
    return np.array(with_points(text).split(), dtype=np.float64)


def rows_of(text: str) -> np.ndarray:
    """Parse the numbers of a text as (lines, numbers per line); comments begin with #.

    Raises ValueError for a text without numbers, KnownFault for words among them and for lines of unequal length."""
    lines = [line for line in with_points(text).splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise ValueError("no numbers")
    try:
        return np.loadtxt(lines, dtype=np.float64, ndmin=2)
    except ValueError:
        for line in lines:
            if words := odd_words(line):
                raise KnownFault(*words_among_numbers(words)) from None
        counts = [len(line.split()) for line in lines]
        if set(counts[1:]) == {counts[0] + 1}:
            raise KnownFault(*AXES) from None
        odd = next((row for row, count in enumerate(counts) if count != counts[0]), 0)
        told = f"row {odd + 1} has {counts[odd]} numbers, and row 1 has {counts[0]}"
        raise KnownFault(told, "give each row the same count of numbers") from None


def odd_words(line: str) -> str:
    """Return the words of a line that are no numbers, each once; "" if there are none."""
    words = (word for word in re.split(r"[\s;,]+", line.replace('"', "")) if word and not _NUMBER.fullmatch(word))
    return " ".join(dict.fromkeys(words))


def words_among_numbers(words: str) -> tuple[str, str]:
    """Return the fault and the remedy for words in the place of a number."""
    return f"'{shortened(words)}' is not a number", "write nan for points that were not measured"


def with_points(text: str) -> str:
    """Rewrite a text to decimal points and blanks between numbers, without comment lines.

    A comma is a decimal comma if the text has no points, but has tabs, semicolons, or blanks that follow no comma."""
    values = "\n".join(line for line in text.splitlines() if not line.lstrip().startswith("#")).replace('"', "")
    if "," in values:
        head = values[: 1 << 16]
        others = head.replace(", ", ",").strip()
        between = ";" in others or "\t" in others or " " in others.replace("\n", "")
        decimal = between and "." not in head
        values = values.replace(",", "." if decimal else " ")
    return values.replace(";", " ")


def is_numbers(beginning: bytes) -> bool:
    """Whether the beginning of a file is lines of numbers, apart from lines that begin with #."""
    if not beginning or b"\0" in beginning:
        return False
    lines = decoded(beginning).replace('"', "").splitlines()
    # The last line may be cut, unless it is the only one or the file ends there.
    whole = lines[:-1] if len(lines) > 1 and not beginning.endswith((b"\n", b"\r")) and len(beginning) > 1000 else lines
    values = [line for line in whole if line.strip() and not line.lstrip().startswith("#")]
    words = [word for line in values for word in line.replace(";", " ").split()]
    return bool(words) and all(_is_number(word) for word in words)


def _is_number(word: str) -> bool:
    return all(_NUMBER.fullmatch(part) for part in word.strip(",").split(",") if part) and word.strip(",") != ""


# Gwyddion reads about 150 formats, and its own files are read here without loss.
CONVERT = "convert it with Gwyddion: gwyddion --convert-to-gwy=OUT.gwy IN"

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
    """Return the name of the first file in a zip archive with these first bytes; [] if it is no archive."""
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


# The most points of a map, the same as Pillow's limit for pictures.
_POINTS_MAX = 89_478_485
# At most 8 bytes each for stored values, unpacked values and heights.
_BYTES_PER_POINT = 24
# The exceptions of Python and NumPy for bytes that violate a format.
DAMAGE = (LookupError, ValueError, TypeError, ArithmeticError, EOFError, struct.error, zlib.error)


def refuse_too_large(source: str, shape: tuple[int, int]) -> None:
    """Raise GratingError if a map of (rows, cols) has too many points or would take too much of the free memory.

    Call it before allocating memory for the points."""
    rows, cols = shape
    if rows * cols > _POINTS_MAX:
        raise GratingError(
            source, f"{rows} x {cols} points are more than {_POINTS_MAX // 10**6} million", "crop or reduce the scan"
        )
    refuse_beyond_memory(
        _BYTES_PER_POINT * rows * cols, f"reading {rows} x {cols} pixels", "crop or reduce the scan", source=source
    )


@dataclass(frozen=True)
class StoredMap:
    """One map of values in a file, not read yet.

    shape         (rows, cols)
    pixel_size_m  (dy, dx); NaN or 0 if the file stores no lengths
    load          reads the values (rows, cols) in the channel's unit, row 0 the scan's top, NaN if missing"""

    channel: Channel
    shape: tuple[int, int]
    pixel_size_m: tuple[float, float]
    load: Callable[[BinaryIO], np.ndarray]


@dataclass(frozen=True)
class ScanReader:
    """Reader of a format that holds its units, see `Reader`.

    begins  recognises a file by its first bytes
    maps    lists the maps of an open file in the file's order; raises one of DAMAGE, or KnownFault"""

    name: str
    extensions: tuple[str, ...]
    begins: Callable[[bytes], bool]
    maps: Callable[[BinaryIO], list[StoredMap]]
    needs_size: bool = False

    def can_read(self, beginning: bytes) -> bool:
        """As in `Reader`."""
        return self.begins(beginning)

    def channels(self, source: str) -> tuple[Channel, ...]:
        """As in `Reader`; reads no heights."""
        with open(source, "rb") as file:
            return tuple(each.channel for each in self._maps(source, file))

    def read(
        self,
        source: str,
        *,
        size_um: float | None = None,
        height_nm: float | None = None,
        channel: str | None = None,
    ) -> HeightMap:
        """As in `Reader`."""
        with open(source, "rb") as file:
            maps = self._maps(source, file)
            channels = tuple(each.channel for each in maps)
            chosen = maps[choose_channel(source, channels, channel)]
            refuse_too_large(source, chosen.shape)
            pixel_size_m, stored_width_m = sized(source, chosen.pixel_size_m, cols=chosen.shape[1], size_um=size_um)
            try:
                with np.errstate(all="ignore"):  # HeightMap refuses infinite heights
                    heights = chosen.load(file)
            except DAMAGE as error:
                raise self._damaged(source, error) from error
        return HeightMap(
            height_m=heights,
            pixel_size_m=pixel_size_m,
            source=source,
            channel=chosen.channel.label,
            channels=tuple(each.label for each in channels),
            stored_width_m=stored_width_m,
        )

    def _maps(self, source: str, file: BinaryIO) -> list[StoredMap]:
        """List the maps of a file; numbers distinguish equal labels."""
        try:
            maps = self.maps(file)
        except KnownFault as error:
            raise GratingError(source, error.fault, error.remedy) from error
        except DAMAGE as error:
            raise self._damaged(source, error) from error
        shared = Counter(each.channel.label for each in maps)
        return [
            replace(each, channel=replace(each.channel, frame=f"{each.channel.frame} ({number})".strip()))
            if shared[each.channel.label] > 1
            else each
            for number, each in enumerate(maps, 1)
        ]

    def _damaged(self, source: str, error: Exception) -> GratingError:
        what = f"{error} is missing" if isinstance(error, KeyError) else error
        return GratingError(
            source,
            f"the {self.name} data is truncated, damaged or of an unknown kind ({shortened(what)})",
            f"copy it again, or {CONVERT}",
        )


@dataclass(frozen=True)
class Block:
    """Uncompressed values in a file: (rows, cols) numbers of NumPy type `kind` from byte `start` on."""

    start: int
    shape: tuple[int, int]
    kind: str

    def __post_init__(self) -> None:
        if min(self.shape) < 1 or self.start < 0:
            raise ValueError(f"a map of {self.shape[0]} x {self.shape[1]} values")

    @property
    def nbytes(self) -> int:
        """Length in bytes."""
        return math.prod(self.shape) * np.dtype(self.kind).itemsize

    def within(self, file: BinaryIO) -> Block:
        """Return the block. Raises ValueError if the file ends before it."""
        held = max(0, file.seek(0, os.SEEK_END) - self.start)
        if self.nbytes > held:
            raise ValueError(f"{self.shape[0]} x {self.shape[1]} values declared, and {held} bytes are there")
        return self

    def read(self, file: BinaryIO) -> np.ndarray:
        """Read the stored values (rows, cols)."""
        file.seek(self.start)
        return np.fromfile(file, self.kind, math.prod(self.shape)).reshape(self.shape)

    def scaled(self, file: BinaryIO, *, scale: float, offset: float = 0.0) -> np.ndarray:
        """Read the values times `scale` plus `offset`, float64."""
        values = self.read(file) * np.float64(scale)
        values += offset
        return values


def read_exactly(file: BinaryIO, start: int, count: int) -> bytes:
    """Read `count` bytes from `start` on. Raises EOFError if the file is too short."""
    held = max(0, file.seek(0, os.SEEK_END) - start)
    if count > held:  # Python would allocate them before reading
        raise EOFError(f"{count - held} bytes are missing")
    file.seek(start)
    return file.read(count)
