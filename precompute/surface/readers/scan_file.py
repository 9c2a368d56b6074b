# SPDX-License-Identifier: GPL-3.0-or-later
"""What all readers of files share: their protocol, the choice of channel, units, sizes that the user gives, refusals.

ScanReader is the common reader of instrument files; a format supplies the maps of a file and how to read them. A new
format needs a module with a reader, and a line in READERS of reader_registry.py. Blender loads the registry at
startup, so a reader imports its decoder (Pillow) only in the functions that decode."""

from __future__ import annotations

import math
import os
import struct
import zlib
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import BinaryIO, Protocol, runtime_checkable

import numpy as np

from ...base.failure import GratingError, Setting, Words
from ...base.machine import refuse_beyond_memory
from ..height_map import HeightMap

# Gwyddion reads about 150 formats, and its own files are read here without loss.
CONVERT = "convert it with Gwyddion: gwyddion --convert-to-gwy=OUT.gwy IN"
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


def decoded(data: bytes) -> str:
    """Decode bytes as UTF-8 or else Latin-1."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


# Plausible widths in micrometres and heights in nanometres: no relief is a metre wide, or lower than an atom.
_SIZE_UM = (1e-3, 1e6)
_LOWEST_NM, HIGHEST_NM = 1e-3, 1e6
# The height of the number 1 if numbers are metres.
METRE_NM = 1e9


def given_width(source: str, size_um: float | None, *, fault: str) -> float:
    """Return the width in micrometres. Raises GratingError if it is implausible, or with `fault` if it is missing."""
    remedy = ("give ", Setting.SIZE_UM, ", the width of the scan in micrometres")
    return _quantity(source, "size", size_um, limits=_SIZE_UM, fault=fault, remedy=remedy)


def given_height(source: str, height_nm: float | None, *, fault: str, what: str, most: float = HIGHEST_NM) -> float:
    """Return the height in nanometres. Raises GratingError, which quotes `what`, if it is implausible, or with `fault`
    if it is missing."""
    remedy = ("give ", Setting.HEIGHT_NM, f", {what} in nanometres")
    return _quantity(source, "height range", height_nm, limits=(_LOWEST_NM, most), fault=fault, remedy=remedy)


def _quantity(
    source: str, what: str, value: float | None, *, limits: tuple[float, float], fault: str, remedy: Words
) -> float:
    """Return the value. Raises GratingError if it is missing or outside the limits."""
    if value is None:
        raise GratingError(source, fault, remedy)
    if not (math.isfinite(value) and limits[0] <= value <= limits[1]):
        raise GratingError(source, f"a {what} of {value:g} is not between {limits[0]:g} and {limits[1]:g}", remedy)
    return value


def sized(
    source: str, pixel_size_m: tuple[float, float], *, cols: int, size_um: float | None
) -> tuple[tuple[float, float], float | None]:
    """Return (dy, dx) of a file's pixels, and the file's own width in metres if the user's width replaces it.

    The user's width keeps the pixels' aspect ratio. If a side in the file is not a positive number, the pixels are
    square and the file's own width is NaN. Raises GratingError if both widths are missing, or the user's is
    implausible."""
    is_stored = all(math.isfinite(side) and side > 0 for side in pixel_size_m)
    if is_stored and size_um is None:
        return pixel_size_m, None
    dy, dx = pixel_size_m if is_stored else (1.0, 1.0)
    pixel = given_width(source, size_um, fault="the file has no usable pixel size") * 1e-6 / cols
    return (pixel * dy / dx, pixel), cols * dx if is_stored else math.nan


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
