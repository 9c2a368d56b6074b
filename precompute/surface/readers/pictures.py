# SPDX-License-Identifier: GPL-3.0-or-later
"""Readers of heights in pictures and arrays, and of the width in a file's name: 10 um for "skin_10um.png".

In grey PNG, TIFF and BMP pictures black is the height 0, white the height that the user gives. Pillow reads all texts,
profiles and tags into memory, with the length that the file declares, and walks through all pages of a TIFF. So a small
or sparse file can cost gigabytes or minutes. Before Pillow opens a file, the data beside its pixels are measured by
their lengths. (Formats: PNG (Third Edition), section 5; TIFF 6.0, section 2, and BigTIFF; BITMAPINFOHEADER of BMP.)

OpenEXR .exr holds one channel or grey RGB, in scan lines, uncompressed or ZIP. (Format: "OpenEXR File Layout",
openexr.com.)

NumPy .npy holds an array (rows, cols) of numbers, row 0 the scan's top; pickled objects are never read. (Format:
NumPy's reference, "numpy.lib.format". NumPy's own header parser raises undocumented exceptions.)"""

from __future__ import annotations

import math
import os
import re
import struct
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, cast

import numpy as np

from ...base.exr_reader import attributes, unpacked
from ...base.failure import GratingError
from ...base.machine import bundled, refuse_beyond_memory
from ..height_map import HeightMap
from .numbers_file import Judge, Numbers, NumbersReader
from .scan_file import (
    CONVERT,
    HIGHEST_NM,
    METRE_NM,
    Block,
    Channel,
    given_height,
    given_width,
    read_exactly,
    shortened,
)

if TYPE_CHECKING:
    from PIL import Image
    from PIL.PngImagePlugin import PngImageFile
    from PIL.TiffImagePlugin import TiffImageFile


# The most bytes beside the picture; no scan needs more. Counting stops beyond it.
BESIDE_MAX = 4 << 20
# A decoder's least memory per chunk or tag.
_EACH_BYTES = 64
# Bytes of a value by TIFF type; other types are skipped.
_TIFF_TYPE_BYTES = {
    1: 1,
    2: 1,
    3: 2,
    4: 4,
    5: 8,
    6: 1,
    7: 1,
    8: 2,
    9: 4,
    10: 8,
    11: 4,
    12: 8,
    13: 4,
    16: 8,
    17: 8,
    18: 8,
}
# Tags that point to further directories, which Pillow reads too: Exif, GPS and interoperability.
_TIFF_FURTHER = (34665, 34853, 40965)


@dataclass(frozen=True)
class Beside:
    """The data beside the pixels: the bytes that a decoder would read, and whether there are several pictures."""

    held_bytes: int
    several: bool = False


def beside_png(file: BinaryIO) -> Beside:
    """Add the lengths of all chunks except the picture's."""
    size = file.seek(0, os.SEEK_END)
    at, held, several = 8, 0, False
    while at + 8 <= size and held <= BESIDE_MAX:
        file.seek(at)
        length, kind = struct.unpack(">I4s", file.read(8))
        held += _EACH_BYTES + (0 if kind == b"IDAT" else length)
        if kind == b"acTL":  # an animation; its first number is the number of pictures
            several = several or file.read(4) not in (b"\0\0\0\0", b"\0\0\0\1")
        if kind == b"IEND":
            break
        at += length + 12
    return Beside(held, several)


def beside_tiff(file: BinaryIO) -> Beside:
    """Add the lengths of all values of the first directory and its subdirectories; look for another page."""
    file.seek(0)
    beginning = file.read(16)
    order = "<" if beginning.startswith(b"II") else ">"
    big = b"+" in beginning[2:4]
    first = struct.unpack_from(f"{order}Q", beginning, 8) if big else struct.unpack_from(f"{order}I", beginning, 4)
    held, further, after = _directory(file, first[0], order, big=big)
    for start in further:
        held += _directory(file, start, order, big=big)[0]
    return Beside(held, after != 0)


def beside_bmp(file: BinaryIO) -> Beside:
    """Read the length of the header."""
    file.seek(14)
    return Beside(struct.unpack("<I", file.read(4))[0])


def _directory(file: BinaryIO, start: int, order: str, *, big: bool) -> tuple[int, list[int], int]:
    """Return the bytes of a directory's values, the starts of its subdirectories, and the start of the next page or 0.

    `order` is the byte order, `big` marks BigTIFF. Raises struct.error if the file ends too soon."""
    counter, entry, offset = (f"{order}Q", f"{order}HHQQ", f"{order}Q") if big else (
        f"{order}H", f"{order}HHII", f"{order}I"
    )  # fmt: skip
    file.seek(start)
    (count,) = struct.unpack(counter, file.read(struct.calcsize(counter)))
    held = 0
    further: list[int] = []
    for _ in range(min(count, 1 << 16)):
        tag, kind, items, value = struct.unpack(entry, file.read(struct.calcsize(entry)))
        held += _EACH_BYTES + _TIFF_TYPE_BYTES.get(kind, 0) * items
        if held > BESIDE_MAX:
            return held, further, 0
        if tag in _TIFF_FURTHER:
            further.append(value)
    (after,) = struct.unpack(offset, file.read(struct.calcsize(offset)))
    return held, further, after


# The longest side in pixels. Pillow's memory for a compressed BMP grows with it, not only with the area.
_SIDE_MAX = 1 << 16
# The largest compressed BMP. Pillow decodes it in Python, at about a microsecond a byte.
_PACKED_BMP_MAX = 4 << 20
# 8 bytes per pixel for the heights, and at most 8 for the picture and its decoding.
_BYTES_PER_PIXEL = 16
# Pixels converted at a time.
_PIXELS_AT_ONCE = 1 << 20
# The most pixels in a byte of a compressed file: a pixel takes at least one bit; deflate packs at most 1032 bytes into
# one, LZW about 1400. A header with more pixels is wrong.
_MOST_PACKED_PIXELS = 8 * 1400
# The value of white in Pillow's grey modes.
_WHITE = {"L": 255, "I;16": 65535, "I;16B": 65535, "F": 1}
# Private tags of Park Systems, which hold the heights; the visible picture is a coloured rendering.
_PARK_TAGS = (50434, 50435)
_TIFF_BITS, _TIFF_PHOTOMETRIC, _TIFF_SAMPLE_FORMAT = 258, 262, 339
_UNSIGNED, _FLOATING = 1, 3
# Pillow's names of the pixels per length along x and y, and the largest ratio of the two that may be rounding.
_DENSITIES, _SQUARE = ("dpi", "aspect", "resolution"), 1.02
# The tag of the orientation, which is 1 if row 0 is on top, and the flips that Pillow undoes in a TIFF.
_ORIENTATION, _PILLOW_FLIPS = 274, (2, 3, 4)


@dataclass(frozen=True)
class PictureReader:
    """Reader of a picture format, see `Reader`.

    beginnings  possible first bytes of a file
    beside      measures the data that a file holds beside its pixels
    highest_nm  greatest height of white over black"""

    name: str
    extensions: tuple[str, ...]
    beginnings: tuple[bytes, ...]
    beside: Callable[[BinaryIO], Beside]
    highest_nm: float = HIGHEST_NM
    needs_size: bool = True

    def can_read(self, beginning: bytes) -> bool:
        """As in `Reader`."""
        return beginning.startswith(self.beginnings)

    def channels(self, source: str) -> tuple[Channel, ...]:
        """Return (): a picture holds one unnamed map."""
        return ()

    def read(
        self,
        source: str,
        *,
        size_um: float | None = None,
        height_nm: float | None = None,
        channel: str | None = None,
    ) -> HeightMap:
        """As in `Reader`.

        size_um     width, left to right, in micrometres, from outer edge to outer edge; pixels are square
        height_nm   height in nanometres of white over black, also if the picture uses only a part of that range: of 255
                    over 0 with 8 bits, 65535 over 0 with 16 bits, 1 over 0 with floats (1e9 if they are metres)
        Fully transparent pixels are missing. Raises GratingError also for coloured pictures, and for signed numbers,
        which define no black and white."""
        size_um = given_width(source, size_um, fault="a picture stores no width")
        what, fault = "the height of white over black", "a picture stores no height"
        height_nm = given_height(source, height_nm, fault=fault, what=what, most=self.highest_nm)
        self._refuse_what_is_beside(source)
        with np.errstate(invalid="ignore"):  # from a signalling NaN
            heights = _grey(source)
        heights *= height_nm * 1e-9
        pixel_m = size_um * 1e-6 / heights.shape[1]
        return HeightMap(heights, (pixel_m, pixel_m), source)

    def _refuse_what_is_beside(self, source: str) -> None:
        """Raise GratingError if the file holds several pictures, or too much data beside its picture."""
        try:
            with open(source, "rb") as file:
                beside = self.beside(file)
        except (struct.error, ValueError, OverflowError) as error:  # the last two: impossible positions
            raise GratingError(source, "the picture's header is truncated or damaged", "copy it again") from error
        if beside.several:
            raise GratingError(source, "holds several pictures", "save only the picture of heights")
        if beside.held_bytes > BESIDE_MAX:
            raise GratingError(
                source,
                f"holds more than {BESIDE_MAX >> 20} MiB beside its picture",
                "save it again without texts, profiles and tags",
            )


PNG = PictureReader("PNG", (".png",), (b"\x89PNG\r\n\x1a\n",), beside_png)
TIFF = PictureReader("TIFF", (".tif", ".tiff"), (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"), beside_tiff, METRE_NM)
BMP = PictureReader("BMP", (".bmp",), (b"BM",), beside_bmp)


def _grey(source: str) -> np.ndarray:
    """Read the picture as (rows, cols) float64: 0 black, 1 white, NaN transparent."""
    Image = bundled("PIL.Image")
    try:
        with warnings.catch_warnings():
            # Pillow warns of pictures over 89 million pixels (9459 squared). Here the warning is an error. Pillow's
            # other warnings are harmless, or an error follows.
            warnings.simplefilter("ignore")
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(source, formats=("PNG", "TIFF", "BMP")) as picture:
                _refuse_what_is_no_grey_scale(source, picture)
                return _levels(source, picture)
    except (GratingError, MemoryError):
        raise
    except (Image.DecompressionBombWarning, Image.DecompressionBombError) as error:
        raise GratingError(
            source, f"the header declares more than {Image.MAX_IMAGE_PIXELS} pixels", "crop or reduce the scan"
        ) from error
    except Exception as error:  # Pillow's decoders raise nearly anything on a damaged file.
        raise GratingError(
            source,
            f"the picture is truncated, damaged or of an unknown kind ({shortened(error)})",
            "save it again as 8 or 16-bit grey PNG",
        ) from error


def _refuse_what_is_no_grey_scale(source: str, picture: Image.Image) -> None:
    """Raise GratingError if the header shows that the picture is too large or unusable; decodes nothing."""
    (cols, rows), file_bytes = picture.size, Path(source).stat().st_size
    is_packed = picture.info.get("compression") not in ("raw", 0)
    if rows * cols > (_MOST_PACKED_PIXELS if is_packed else 8) * file_bytes:
        raise GratingError(
            source,
            f"the header declares {rows} x {cols} pixels, more than the file can hold",
            "it is truncated, copy it again",
        )
    if max(rows, cols) > _SIDE_MAX:
        raise GratingError(source, f"{rows} x {cols} pixels are over {_SIDE_MAX} along a side", "crop the scan")
    if picture.format == "BMP" and is_packed and file_bytes > _PACKED_BMP_MAX:
        raise GratingError(source, f"a compressed BMP of {file_bytes >> 20} MiB", "save it as PNG")
    along_x, along_y = next((picture.info[name] for name in _DENSITIES if name in picture.info), (1, 1))
    if max(along_x, along_y) > _SQUARE * min(along_x, along_y) > 0:
        raise GratingError(
            source,
            f"its pixels are not square, {float(along_x):.3g} to {float(along_y):.3g} per length",
            "resample it to square pixels, or save it without a resolution",
        )
    orientation = picture.getexif().get(_ORIENTATION, 1)
    if orientation != 1 and not (picture.format == "TIFF" and orientation in _PILLOW_FLIPS):
        raise GratingError(
            source, f"its picture is stored rotated (orientation {orientation})", "rotate it and save it upright"
        )
    refuse_beyond_memory(
        _BYTES_PER_PIXEL * rows * cols, f"reading {rows} x {cols} pixels", "crop or reduce the scan", source=source
    )
    bits = _bits(picture)
    if picture.mode not in _WHITE and bits > 8:
        raise GratingError(
            source,
            f"{bits} bits a value in mode '{picture.mode}' are not scaled by black and white",
            "save it as 16-bit grey without colour or alpha",
        )
    if picture.format == "TIFF":
        _refuse_odd_tiff(source, picture, bits)


def _refuse_odd_tiff(source: str, picture: Image.Image, bits: int) -> None:
    """Raise GratingError unless the values of a TIFF run from black 0 to white."""
    tags = cast("TiffImageFile", picture).tag_v2
    if any(tag in tags for tag in _PARK_TAGS):
        raise GratingError(source, "a Park instrument file, whose heights are not in the visible picture", CONVERT)
    form = set(np.atleast_1d(tags.get(_TIFF_SAMPLE_FORMAT, 1)))
    is_known = (form == {_UNSIGNED} and bits in (1, 2, 4, 8, 16)) or (form == {_FLOATING} and bits == 32)
    if not is_known or (bits >= 16 and tags.get(_TIFF_PHOTOMETRIC) == 0):
        raise GratingError(
            source,
            f"its values are signed, of {bits} bits or counted from white, and have no unit",
            "save it as 16-bit grey, black 0 and white 65535, or as 32-bit floats, white 1",
        )


def _bits(picture: Image.Image) -> int:
    """Read the bits per value from the file; Pillow hides them, and drops the lower 8 of 16-bit colour."""
    if picture.format == "PNG":
        with open(cast("PngImageFile", picture).filename, "rb") as file:
            return file.read(25)[24]
    if picture.format == "TIFF":
        return int(np.max(cast("TiffImageFile", picture).tag_v2.get(_TIFF_BITS, 1)))
    return 8


def _levels(source: str, picture: Image.Image) -> np.ndarray:
    """Decode the picture for _grey, a few rows at a time. Raises GratingError if it is coloured."""
    cols, rows = picture.size
    levels = np.empty((rows, cols))
    step = max(1, _PIXELS_AT_ONCE // cols)
    for start in range(0, rows, step):
        band = picture.crop((0, start, cols, min(start + step, rows)))
        levels[start : start + step] = _levels_of_band(source, band)
    return levels


def _levels_of_band(source: str, band: Image.Image) -> np.ndarray:
    if band.mode == "1":
        band = band.convert("L")
    if band.mode in _WHITE:
        return np.asarray(band) / float(_WHITE[band.mode])
    red, green, blue, alpha = np.moveaxis(np.asarray(band.convert("RGBA")), -1, 0)
    seen = alpha > 0
    if ((red != green) | (green != blue))[seen].any():
        raise GratingError(source, "the picture is coloured, and colours are not heights", "export the heights in grey")
    return np.where(seen, red / 255.0, np.nan)


_MAGIC, _SCAN_LINES_OF_VERSION_2 = b"v/1\x01", b"\2\0\0\0"
_KINDS = {0: "<u4", 1: "<f2", 2: "<f4"}
# Rows per block by compression: none, ZIP of one row, ZIP of 16 rows.
_ROWS_IN_BLOCK = {0: 1, 2: 1, 3: 16}
_HEAD_MAX = 1 << 20
# Deflate packs at most this many bytes into one.
_MOST_PACKED = 1032
# Names of a height channel among others, in order of preference.
_HEIGHTS = ("Y", "Z", "height", "Height", "V")


def _channels(value: bytes) -> list[tuple[str, str]]:
    """Read the channels' names and types in file order. Raises ValueError for a subsampled channel."""
    found, at = [], 0
    while value[at : at + 1] != b"\0":
        end = value.index(b"\0", at)
        kind, _, step_x, step_y = struct.unpack_from("<4i", value, end + 1)
        if (step_x, step_y) != (1, 1):
            raise ValueError("a channel of fewer pixels")
        found.append((value[at:end].decode("ascii"), _KINDS[kind]))
        at = end + 17
    return found


def _load_exr(file: BinaryIO, judge: Judge) -> Numbers:
    file.seek(0)
    head = file.read(_HEAD_MAX)
    if head[4:8] != _SCAN_LINES_OF_VERSION_2:
        raise ValueError("tiles or several parts; save it as scan lines")
    facts, table_at = attributes(head)
    left, top, right, bottom = struct.unpack("<4i", facts["dataWindow"][1])
    cols, rows = right - left + 1, bottom - top + 1
    packing = facts["compression"][1][0]
    if packing not in _ROWS_IN_BLOCK:
        raise ValueError("a packing other than ZIP; save it with ZIP or none")
    channels = _channels(facts["channels"][1])
    row_bytes = cols * sum(np.dtype(kind).itemsize for _, kind in channels)
    held = file.seek(0, os.SEEK_END)
    if min(rows, cols, row_bytes) < 1 or rows * row_bytes > _MOST_PACKED * held:
        raise ValueError(f"{rows} x {cols} pixels declared, and {held} bytes are there")
    wanted = _wanted([name for name, _ in channels])
    judge((rows, cols))
    heights = np.empty((rows, cols))
    high = _ROWS_IN_BLOCK[packing]
    places = struct.unpack(f"<{-(-rows // high)}Q", read_exactly(file, table_at, 8 * math.ceil(rows / high)))
    for place in places:
        row, size = struct.unpack("<2i", read_exactly(file, place, 8))
        first = row - top
        count = min(high, rows - first)
        if first < 0 or first % high or count < 1 or not 0 < size <= count * row_bytes:
            raise ValueError(f"a block of {size} bytes at row {first}")
        block = unpacked(read_exactly(file, place + 8, size), count * row_bytes).reshape(count, row_bytes)
        heights[first : first + count] = _grey_of_exr(block, channels, wanted, cols=cols)
    (width_over_height,) = struct.unpack("<f", facts["pixelAspectRatio"][1])
    return Numbers(heights, 1 / width_over_height)


def _wanted(names: list[str]) -> list[str]:
    """Choose the channels that hold the heights. Raises ValueError if there are none."""
    if len(names) == 1:
        return names
    single = next((name for name in _HEIGHTS if name in names), None)
    if single is None and not {"R", "G", "B"} <= set(names):
        raise ValueError(f"channels {', '.join(names)}; save the heights as the channel Y")
    return [single] if single else ["R", "G", "B"]


def _grey_of_exr(block: np.ndarray, channels: list[tuple[str, str]], wanted: list[str], *, cols: int) -> np.ndarray:
    """Extract the heights of a block's rows. Raises ValueError if it is coloured."""
    found, at = {}, 0
    for name, kind in channels:
        size = cols * np.dtype(kind).itemsize
        found[name] = block[:, at : at + size].copy().view(kind)
        at += size
    first, *others = (found[name] for name in wanted)
    if not all(np.array_equal(first, other, equal_nan=True) for other in others):
        raise ValueError("it is coloured, and colours are not heights; save the heights in grey")
    return first


def _begins_exr(beginning: bytes) -> bool:
    return beginning.startswith(_MAGIC)


EXR = NumbersReader("OpenEXR", (".exr",), _begins_exr, _load_exr)


_BEGINNING = b"\x93NUMPY"
# The type of the header's length, by the format's major version.
_LENGTHS = {1: "<H", 2: "<I", 3: "<I"}
_HEADER_MAX = 1 << 14
_KIND = re.compile(r"'descr': *'([<>|=]?(?:[iu][1248]|f[248]|b1))'")
_SHAPE = re.compile(r"'shape': *\((\d{1,10})L?, *(\d{1,10})L?,?\)")
_BY_COLUMNS = re.compile(r"'fortran_order': *True")


def _load(file: BinaryIO, judge: Judge) -> Numbers:
    form = _LENGTHS[read_exactly(file, 0, 8)[6]]
    first = 8 + struct.calcsize(form)
    (length,) = struct.unpack(form, read_exactly(file, 8, first - 8))
    if length > _HEADER_MAX:
        raise ValueError(f"a header of {length} bytes")
    header = read_exactly(file, first, length).decode("latin-1")
    kind, shape = _KIND.search(header), _SHAPE.search(header)
    if kind is None or shape is None:
        raise ValueError("no matrix of numbers")
    rows, cols = int(shape[1]), int(shape[2])
    judge((rows, cols))
    by_columns = _BY_COLUMNS.search(header) is not None
    values = Block(first + length, (cols, rows) if by_columns else (rows, cols), kind[1]).within(file).read(file)
    return Numbers(values.T if by_columns else values)


def _begins(beginning: bytes) -> bool:
    return beginning.startswith(_BEGINNING)


NPY = NumbersReader("NumPy", (".npy",), _begins, _load)


_TO_UM = {"nm": 1e-3, "um": 1.0, "mm": 1e3}
_UNITS = r"(?P<unit>nm|[u\u00b5\u03bc]m|mm|microns?|micromet(?:er|re)s?|nanomet(?:er|re)s?)"
# Comma and three digits may be a thousand or a decimal fraction, so such a number is not read.
_NUMBER = r"\d+(?:\.\d+|,\d{1,2}(?!\d)|,\d{4,})?"
# A letter or digit directly before the number makes it a part of a word, such as X100um, unless the word is a width.
_WIDTH = re.compile(
    rf"(?<![^\W_])(?:width|size|scan)?(?<!\d[.,])(?P<width>{_NUMBER})\s?"
    rf"(?:{_UNITS.replace('unit', 'other')}?(?:x|\u00d7| x | \u00d7 ){_NUMBER}\s?)?{_UNITS}(?![^\W_])",
    re.IGNORECASE,
)
# Words directly before or after a length that is no width of a scan.
_OTHERS = {
    "period", "pitch", "spacing", "lines", "grating", "groove", "step", "pixel", "pixels", "px", "per", "resolution",
    "height", "high", "depth", "deep", "tall", "thick", "thickness", "z", "rms", "ra", "range", "lambda", "wavelength",
    "laser", "light", "led", "filter", "radius", "tip", "bar", "scalebar", "film", "layer", "coating", "offset",
}  # fmt: skip
_WORD = re.compile(r"[^\W\d_]+")
# The widths of scans in micrometres.
_LIMITS_UM = (1e-3, 1e6)


def named_width_um(path: str) -> float | None:
    """The width in micrometres that a file's name says; None if it says none, or several that differ.

    Of "10x5um" it is the first. Nanometres count only if nothing is in micrometres or millimetres, because they are
    often a height."""
    name = Path(path).stem
    found = [each for each in _WIDTH.finditer(name) if not _is_other(name, each)]
    coarse = {_um(each) for each in found if _unit(each) != "nm"}
    widths = coarse or {_um(each) for each in found}
    if len(widths) != 1:
        return None
    (width,) = widths
    return width if _LIMITS_UM[0] <= width <= _LIMITS_UM[1] else None


def _is_other(name: str, found: re.Match[str]) -> bool:
    """Whether the word before or after a length says that it is another quantity."""
    before, after = _WORD.findall(name[: found.start()]), _WORD.match(name[found.end() :].lstrip(" _-./()"))
    words = {before[-1].lower()} if before and not re.search(r"\d[^\d]*$", name[: found.start()]) else set()
    return bool((words | ({after[0].lower()} if after else set())) & _OTHERS)


def _unit(found: re.Match[str]) -> str:
    unit = found["unit"].lower()
    return "nm" if unit.startswith("n") else "mm" if unit == "mm" else "um"


def _um(found: re.Match[str]) -> float:
    return round(float(found["width"].replace(",", ".")) * _TO_UM[_unit(found)], 9)
