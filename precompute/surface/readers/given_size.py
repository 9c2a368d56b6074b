# SPDX-License-Identifier: GPL-3.0-or-later
"""Sizes that the user gives for files without units: pictures and bare arrays of numbers."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import BinaryIO

import numpy as np

from ...base.failure import GratingError, Setting, Words
from ..height_map import HeightMap
from .channels import Channel, shortened
from .scan_file import DAMAGE, refuse_too_large

# Plausible widths in micrometres and heights in nanometres: no relief is a metre wide, or lower than an atom.
_SIZE_UM = (1e-3, 1e6)
_LOWEST_NM, HIGHEST_NM = 1e-3, 1e6
# The height of the number 1 if numbers are metres.
METRE_NM = 1e9
# Takes (rows, cols), and raises GratingError if this map is too large.
Judge = Callable[[tuple[int, int]], None]


def given_width(source: str, size_um: float | None) -> float:
    """Return the width in micrometres. Raises GratingError if it is missing or implausible."""
    remedy = ("give ", Setting.SIZE_UM, ", the width of the scan in micrometres")
    return _quantity(source, "size", size_um, limits=_SIZE_UM, remedy=remedy)


def given_height(source: str, height_nm: float | None, *, what: str, most: float = HIGHEST_NM) -> float:
    """Return the height in nanometres. Raises GratingError, which quotes `what`, if it is missing or implausible."""
    remedy = ("give ", Setting.HEIGHT_NM, f", {what} in nanometres")
    return _quantity(source, "height range", height_nm, limits=(_LOWEST_NM, most), remedy=remedy)


def _quantity(source: str, what: str, value: float | None, *, limits: tuple[float, float], remedy: Words) -> float:
    """Return the value. Raises GratingError if it is missing or outside the limits."""
    if value is None:
        raise GratingError(source, f"a picture carries no {what}", remedy)
    if not (math.isfinite(value) and limits[0] <= value <= limits[1]):
        raise GratingError(source, f"a {what} of {value:g} is not between {limits[0]:g} and {limits[1]:g}", remedy)
    return value


@dataclass(frozen=True)
class Numbers:
    """Numbers (rows, cols), row 0 the scan's top, and the ratio of a pixel's height to its width."""

    values: np.ndarray
    pixel_aspect: float = 1.0


@dataclass(frozen=True)
class NumbersReader:
    """Reader of a format that holds one array of numbers without units, see `Reader`.

    begins  recognises a file by its first bytes
    load    reads the numbers of an open file, after checking their shape; raises one of DAMAGE for a damaged file"""

    name: str
    extensions: tuple[str, ...]
    begins: Callable[[bytes], bool]
    load: Callable[[BinaryIO, Judge], Numbers]
    needs_size: bool = True

    def can_read(self, beginning: bytes) -> bool:
        """As in `Reader`."""
        return self.begins(beginning)

    def channels(self, source: str) -> tuple[Channel, ...]:
        """Return (): the file holds one unnamed map."""
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

        size_um    width, left to right, in micrometres, from outer edge to outer edge
        height_nm  height in nanometres of the number 1: 1e9 if the numbers are metres"""
        width = given_width(source, size_um) * 1e-6
        height = given_height(source, height_nm, what="the height of the number 1 (1e9 for metres)", most=METRE_NM)
        try:
            with open(source, "rb") as file, np.errstate(all="ignore"):  # HeightMap refuses infinite heights
                numbers = self.load(file, partial(refuse_too_large, source))
        except DAMAGE as error:
            raise GratingError(
                source,
                f"the {self.name} data is truncated, damaged or of an unknown kind ({shortened(error)})",
                "save it again, or as Gwyddion .gsf",
            ) from error
        rows, cols = numbers.values.shape
        with np.errstate(all="ignore"):
            heights = numbers.values * np.float64(height * 1e-9)
        return HeightMap(heights, (width / cols * numbers.pixel_aspect, width / cols), source)
