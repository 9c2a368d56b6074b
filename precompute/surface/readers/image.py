# SPDX-License-Identifier: GPL-3.0-or-later
"""Grey PNG, TIFF and BMP pictures as heights: black is 0, white the height that the user gives."""

from __future__ import annotations

import math
import warnings
from pathlib import Path

import numpy as np
from PIL import Image

from ...base.failure import GratingError
from ..height_map import HeightMap

# Nothing outside this is a relief that diffracts light: a picture of 1 m, or of one atom.
_SIZE_UM = (1e-3, 1e6)


_HEIGHT_NM = (1e-3, 1e6)


# Pixels per byte of the file beyond which a header must be lying: a pixel takes a bit or more, and deflate
# packs at most 1032 bytes into one, LZW about 1400.
_MOST_PACKED_PIXELS = 8 * 1400


_WHITE = {"L": 255, "I;16": 65535, "I;16B": 65535}


# Park Systems' private tags: the page one sees is a coloured rendering, the heights lie in these.
_PARK_TAGS = (50434, 50435)


_TIFF_BITS, _TIFF_PHOTOMETRIC, _TIFF_SAMPLE_FORMAT = 258, 262, 339


def read(source: str, size_um: float | None, height_nm: float | None) -> HeightMap:
    """Read a picture as a height map.

    size_um     width across the columns, in micrometres, outer edge to outer edge; pixels are square
    height_nm   height of white over black, in nanometres: of 255 over 0 at 8 bits, of 65535 over 0 at 16,
                whatever range the picture itself uses
    Fully transparent pixels are missing. Raises GratingError where a picture is damaged, coloured, or carries
    numbers that black and white do not scale.
    """
    size_um = _quantity(source, "size", size_um, _SIZE_UM, "--size-um W, the width across the columns in micrometres")
    height_nm = _quantity(
        source, "height range", height_nm, _HEIGHT_NM, "--height-nm H, the height of white over black in nanometres"
    )
    grey = _grey(source)
    pixel_m = size_um * 1e-6 / grey.shape[1]
    return HeightMap(grey * (height_nm * 1e-9), (pixel_m, pixel_m), source)


def _quantity(source: str, what: str, value: float | None, limits: tuple[float, float], remedy: str) -> float:
    if value is None:
        raise GratingError(f"{source}: a picture carries no {what}; give {remedy}")
    if not (math.isfinite(value) and limits[0] <= value <= limits[1]):
        raise GratingError(
            f"{source}: a {what} of {value:g} is not between {limits[0]:g} and {limits[1]:g}; give {remedy}"
        )
    return value


def _grey(source: str) -> np.ndarray:
    """(rows, cols) float64: 0 black, 1 white, NaN transparent."""
    try:
        with warnings.catch_warnings():
            # Pillow's limit (89 million pixels, 9459 squared) is ours too; it warns there, and refuses at
            # twice that. What else it warns of is either harmless or ends in an error.
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
    """Look at the header only, before anything is allocated."""
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
    """Bits a value in the file itself: Pillow silently drops the lower half of 16-bit colour."""
    if picture.format == "PNG":
        with open(picture.filename, "rb") as file:
            return file.read(25)[24]
    if picture.format == "TIFF":
        return int(np.max(picture.tag_v2.get(_TIFF_BITS, 1)))
    return 8


def _levels(source: str, picture: Image.Image) -> np.ndarray:
    if picture.mode == "1":
        picture = picture.convert("L")
    if picture.mode in _WHITE:
        return np.asarray(picture) / float(_WHITE[picture.mode])
    red, green, blue, alpha = np.moveaxis(np.asarray(picture.convert("RGBA")), -1, 0)
    seen = alpha > 0
    if ((red != green) | (green != blue))[seen].any():
        raise GratingError(f"{source}: the picture is coloured, and a colour is no height; export the heights in grey")
    return np.where(seen, red / 255.0, np.nan)
