# SPDX-License-Identifier: GPL-3.0-or-later
"""Grey PNG, TIFF and BMP pictures as heights: black is 0, white the height that the user gives."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ...base.failure import GratingError
from ..height_map import HeightMap
from .channels import Channel

if TYPE_CHECKING:
    from PIL import Image

# Widths and heights outside these ranges are mistakes: no picture of a relief is a metre wide, or one atom high.
_SIZE_UM = (1e-3, 1e6)
_HEIGHT_NM = (1e-3, 1e6)
# The most pixels that a byte of a compressed file can hold. A pixel takes at least one bit; deflate packs at most
# 1032 bytes into one, LZW about 1400. A header that declares more pixels is wrong.
_MOST_PACKED_PIXELS = 8 * 1400
# The value of white in Pillow's grey modes.
_WHITE = {"L": 255, "I;16": 65535, "I;16B": 65535}
# Private tags of Park Systems. These tags hold the heights; the visible picture is a coloured rendering of the heights.
_PARK_TAGS = (50434, 50435)
_TIFF_BITS, _TIFF_PHOTOMETRIC, _TIFF_SAMPLE_FORMAT = 258, 262, 339


@dataclass(frozen=True)
class PictureReader:
    """Reader of one format of pictures, see `Reader`; `beginnings` are the bytes that files may begin with."""

    name: str
    extensions: tuple[str, ...]
    beginnings: tuple[bytes, ...]
    needs_size: bool = True

    def can_read(self, beginning: bytes) -> bool:
        """As in `Reader`."""
        return beginning.startswith(self.beginnings)

    def channels(self, source: str) -> tuple[Channel, ...]:
        """None: a picture holds one map of heights, which has no name."""
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

        size_um     width across the columns in micrometres, from outer edge to outer edge; pixels are square
        height_nm   height in nanometres of white over black: of 255 over 0 in a picture of 8 bits, of 65535 over 0 in
                    one of 16 bits, even where the picture itself uses a part of that range
        Fully transparent pixels are missing. Raises GratingError also where a picture is coloured, or holds numbers
        (floating, signed) for which black and white are not defined.
        """
        size_um = _quantity(
            source, "size", size_um, limits=_SIZE_UM, remedy="--size-um W, the width across the columns in micrometres"
        )
        height_nm = _quantity(
            source,
            "height range",
            height_nm,
            limits=_HEIGHT_NM,
            remedy="--height-nm H, the height of white over black in nanometres",
        )
        grey = _grey(source)
        pixel_m = size_um * 1e-6 / grey.shape[1]
        return HeightMap(grey * (height_nm * 1e-9), (pixel_m, pixel_m), source)


PNG = PictureReader("PNG", (".png",), (b"\x89PNG\r\n\x1a\n",))
TIFF = PictureReader("TIFF", (".tif", ".tiff"), (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"))
BMP = PictureReader("BMP", (".bmp",), (b"BM",))


def _quantity(source: str, what: str, value: float | None, *, limits: tuple[float, float], remedy: str) -> float:
    """The value. Raises GratingError where it is missing or outside of the limits."""
    if value is None:
        raise GratingError(f"{source}: a picture carries no {what}; give {remedy}")
    if not (math.isfinite(value) and limits[0] <= value <= limits[1]):
        raise GratingError(
            f"{source}: a {what} of {value:g} is not between {limits[0]:g} and {limits[1]:g}; give {remedy}"
        )
    return value


def _grey(source: str) -> np.ndarray:
    """The picture as (rows, cols) float64: 0 black, 1 white, NaN transparent."""
    from PIL import Image

    try:
        with warnings.catch_warnings():
            # Pillow warns of pictures over 89 million pixels (9459 squared) and refuses pictures over twice that
            # number. Here the warning is an error. Pillow's other warnings are harmless, or an error follows.
            warnings.simplefilter("ignore")
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(source, formats=("PNG", "TIFF", "BMP")) as picture:
                _refuse_what_is_no_grey_scale(source, picture)
                return _levels(source, picture)
    except GratingError:
        raise
    except (Image.DecompressionBombWarning, Image.DecompressionBombError) as error:
        raise GratingError(
            f"{source}: the header declares more than {Image.MAX_IMAGE_PIXELS} pixels; crop or reduce the scan"
        ) from error
    except Exception as error:  # Pillow's decoders raise nearly anything on a damaged file.
        raise GratingError(
            f"{source}: the picture is truncated, damaged or of an unknown kind ({error}); "
            "save it again as 8 or 16-bit grey PNG"
        ) from error


def _refuse_what_is_no_grey_scale(source: str, picture: Image.Image) -> None:
    """Raise GratingError where the header tells that the picture holds no grey; nothing is decoded yet."""
    cols, rows = picture.size
    packed = 8 if picture.info.get("compression") == "raw" else _MOST_PACKED_PIXELS
    if rows * cols > packed * Path(source).stat().st_size:
        raise GratingError(
            f"{source}: the header declares {rows} x {cols} pixels, more than the file can "
            "hold; it is truncated, copy it again"
        )
    if getattr(picture, "n_frames", 1) > 1:
        raise GratingError(f"{source}: holds {picture.n_frames} pictures; save the one of heights by itself")
    bits = _bits(picture)
    if picture.mode not in _WHITE and bits > 8:
        raise GratingError(
            f"{source}: {bits} bits a value in mode '{picture.mode}' are not scaled by black "
            "and white; save it as 16-bit grey without colour or alpha"
        )
    if picture.format == "TIFF":
        _refuse_odd_tiff(source, picture, bits)


def _refuse_odd_tiff(source: str, picture: Image.Image, bits: int) -> None:
    """Raise GratingError where the values of a TIFF do not run from black 0 to white."""
    tags = picture.tag_v2
    if any(tag in tags for tag in _PARK_TAGS):
        raise GratingError(
            f"{source}: a Park instrument file, whose heights are not in the visible picture; "
            "export it as .gwy from Gwyddion"
        )
    unsigned = set(np.atleast_1d(tags.get(_TIFF_SAMPLE_FORMAT, 1))) == {1}
    if not unsigned or bits not in (1, 2, 4, 8, 16) or (bits == 16 and tags.get(_TIFF_PHOTOMETRIC) == 0):
        raise GratingError(
            f"{source}: its values are signed, floating, of {bits} bits or counted from "
            "white, and carry no unit; save it as 16-bit grey, black 0 and white 65535"
        )


def _bits(picture: Image.Image) -> int:
    """Bits of a value in the file itself; Pillow hides them, and drops the lower 8 of 16-bit colour."""
    if picture.format == "PNG":
        with open(picture.filename, "rb") as file:
            return file.read(25)[24]
    if picture.format == "TIFF":
        return int(np.max(picture.tag_v2.get(_TIFF_BITS, 1)))
    return 8


def _levels(source: str, picture: Image.Image) -> np.ndarray:
    """The decoded picture, as _grey returns it. Raises GratingError where it is coloured."""
    if picture.mode == "1":
        picture = picture.convert("L")
    if picture.mode in _WHITE:
        return np.asarray(picture) / float(_WHITE[picture.mode])
    red, green, blue, alpha = np.moveaxis(np.asarray(picture.convert("RGBA")), -1, 0)
    seen = alpha > 0
    if ((red != green) | (green != blue))[seen].any():
        raise GratingError(f"{source}: the picture is coloured, and a colour is no height; export the heights in grey")
    return np.where(seen, red / 255.0, np.nan)
