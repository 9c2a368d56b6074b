# SPDX-License-Identifier: GPL-3.0-or-later
"""The common reader of bare arrays of numbers, whose sizes the user gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import BinaryIO

import numpy as np

from ...base.failure import GratingError
from ..height_map import HeightMap
from .scan_file import (
    DAMAGE,
    METRE_NM,
    Channel,
    KnownFault,
    given_height,
    given_width,
    refuse_too_large,
    shortened,
)  # fmt: skip

_FAULT = "its numbers have no unit"
# Takes (rows, cols), and raises GratingError if this map is too large.
Judge = Callable[[tuple[int, int]], None]


@dataclass(frozen=True)
class Numbers:
    """Numbers (rows, cols), row 0 the scan's top, and the ratio of a pixel's height to its width."""

    values: np.ndarray
    pixel_aspect: float = 1.0


@dataclass(frozen=True)
class NumbersReader:
    """Reader of a format that holds one array of numbers without units, see `Reader`.

    begins  recognises a file by its first bytes
    load    reads the numbers of an open file, after checking their shape; raises one of DAMAGE, or KnownFault"""

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
        width = given_width(source, size_um, fault=_FAULT) * 1e-6
        what = "the height of the number 1 (1e9 for metres)"
        height = given_height(source, height_nm, fault=_FAULT, what=what, most=METRE_NM)
        try:
            with open(source, "rb") as file, np.errstate(all="ignore"):  # HeightMap refuses infinite heights
                numbers = self.load(file, partial(refuse_too_large, source))
        except KnownFault as error:
            raise GratingError(source, error.fault, error.remedy) from error
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
