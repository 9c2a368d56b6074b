# SPDX-License-Identifier: GPL-3.0-or-later
"""Sizes that the user gives: for files without units, and in place of a file's own width."""

from __future__ import annotations

import math

from ...base.failure import GratingError, Setting, Words

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
