# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of grey PNG, TIFF and BMP pictures: black is the height 0, white the height that the user gives."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, cast

import numpy as np

from ...base.failure import GratingError
from ...base.memory import refuse_beyond_memory
from ...base.packages import bundled
from ..height_map import HeightMap
from .channels import Channel, shortened
from .given_size import HIGHEST_NM, METRE_NM, given_height, given_width
from .picture_file import BESIDE_MAX, Beside, beside_bmp, beside_png, beside_tiff
from .unread import CONVERT

if TYPE_CHECKING:
    from PIL import Image
    from PIL.PngImagePlugin import PngImageFile
    from PIL.TiffImagePlugin import TiffImageFile

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
            raise GratingError(source, "holds several pictures", "save the one of heights by itself")
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
            f"its pixels are declared not to be square, {float(along_x):.3g} to {float(along_y):.3g} per length",
            "resample it to square pixels, or save it without a resolution",
        )
    orientation = picture.getexif().get(_ORIENTATION, 1)
    if orientation != 1 and not (picture.format == "TIFF" and orientation in _PILLOW_FLIPS):
        raise GratingError(
            source, f"its rows and columns are stored turned (orientation {orientation})", "turn it and save it upright"
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
            f"its values are signed, of {bits} bits or counted from white, and carry no unit",
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
        raise GratingError(source, "the picture is coloured, and a colour is no height", "export the heights in grey")
    return np.where(seen, red / 255.0, np.nan)
