# SPDX-License-Identifier: GPL-3.0-or-later
"""The common reader of instrument files; a format supplies the maps of a file and how to read them."""

from __future__ import annotations

import math
import os
import struct
import zlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import BinaryIO

import numpy as np

from ...base.failure import GratingError
from ...base.memory import refuse_beyond_memory
from ..height_map import HeightMap
from .channels import Channel, choose_channel, shortened
from .given_size import sized
from .reader import KnownFault
from .unread import CONVERT

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
