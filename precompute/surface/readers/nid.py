# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of Nanosurf .nid: an INI-like header, then the channels as blocks of integers.

The header ends with "#!". Its [DataSet] section lists the channels of each group, and for each the section that
describes it. The channels' data follow in the same order. Lines run from the scan's bottom up. An integer is a fraction
of the range that the channel's section declares."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.failure import GratingError
from ..height_map import HeightMap
from .channels import Channel, choose_channel, shortened
from .number_text import decoded
from .scan_file import refuse_too_large
from .unread import CONVERT

_BEGINNING = b"[DataSet]"
_HEADER_END = b"\n#!"
# The bytes read at a time, more than most headers have, and the longest header.
_HEADER_STEP, _HEADER_MAX = 1 << 16, 1 << 22
# A channel's key in the index: its group, and its number in the group.
_INDEX = re.compile(r"Gr(\d{1,4})-Ch(\d{1,4})")
# More lines, or points per line, than any scan.
_SIDE_MAX = 10**9


@dataclass(frozen=True)
class _Block:
    """A channel's data block. `size_m` is (Ly, Lx). Values cover `value_range` from `value_min` up, in its unit."""

    channel: Channel
    lines: int
    points: int
    bits: int
    signed: bool
    size_m: tuple[float, float]
    value_min: float
    value_range: float

    @property
    def nbytes(self) -> int:
        """Length in bytes."""
        return self.lines * self.points * self.bits // 8

    def values(self, data: bytes) -> np.ndarray:
        """Convert the block's bytes to values (lines, points), float64 in the channel's unit, from the scan's top."""
        kind = f"<{'i' if self.signed else 'u'}{self.bits // 8}"
        raw = np.frombuffer(data, kind, self.lines * self.points).reshape(self.lines, self.points)
        values = raw[::-1] / 2.0**self.bits
        with np.errstate(over="ignore", invalid="ignore"):  # HeightMap refuses infinite heights
            values += 0.5 if self.signed else 0.0
            values *= self.value_range
            values += self.value_min
        return values


class NanosurfReader:
    """Reader of Nanosurf files, see `Reader`."""

    name = "Nanosurf"
    extensions = (".nid",)
    needs_size = False

    def can_read(self, beginning: bytes) -> bool:
        """As in `Reader`."""
        return beginning.startswith(_BEGINNING)

    def channels(self, source: str) -> tuple[Channel, ...]:
        """As in `Reader`; reads only the header."""
        return tuple(block.channel for block in _header(source)[0])

    def read(
        self,
        source: str,
        *,
        size_um: float | None = None,
        height_nm: float | None = None,
        channel: str | None = None,
    ) -> HeightMap:
        """As in `Reader`."""
        blocks, start = _header(source)
        declared, held = sum(block.nbytes for block in blocks), Path(source).stat().st_size - start
        if declared > held:
            raise GratingError(
                source,
                f"the header declares {declared} bytes of data and {held} are there, the file is truncated",
                "copy it again",
            )
        channels = tuple(block.channel for block in blocks)
        chosen = choose_channel(source, channels, channel)
        block = blocks[chosen]
        refuse_too_large(source, (block.lines, block.points))
        with open(source, "rb") as file:
            file.seek(start + sum(earlier.nbytes for earlier in blocks[:chosen]))
            data = file.read(block.nbytes)
        return HeightMap(
            height_m=block.values(data),
            pixel_size_m=(block.size_m[0] / block.lines, block.size_m[1] / block.points),
            source=source,
            channel=block.channel.label,
            channels=tuple(each.label for each in channels),
        )


NANOSURF = NanosurfReader()


def _header(source: str) -> tuple[list[_Block], int]:
    """Read the data blocks from the header, and the offset of the first in bytes. Raises GratingError."""
    header, end = bytearray(), -1
    with open(source, "rb") as file:
        while end < 0 and len(header) < _HEADER_MAX and (step := file.read(_HEADER_STEP)):
            header += step
            end = header.find(_HEADER_END, max(0, len(header) - len(step) - len(_HEADER_END)))
    if end < 0:
        raise GratingError(source, "the header has no end, the file is truncated or damaged", "copy it again")
    try:
        blocks = _blocks(_sections(decoded(bytes(header[:end]))))
    except (KeyError, ValueError) as error:
        raise GratingError(
            source,
            f"the Nanosurf header is damaged or of an unknown kind ({shortened(error)})",
            f"copy it again, or {CONVERT}",
        ) from error
    return blocks, end + len(_HEADER_END)


def _sections(header: str) -> dict[str, dict[str, str]]:
    """Split the header into the entries of each [section]."""
    sections: dict[str, dict[str, str]] = {}
    entries: dict[str, str] = {}
    for line in header.splitlines():
        if line.startswith("[") and line.endswith("]"):
            entries = sections.setdefault(line[1:-1], {})
        elif "=" in line:
            key, value = line.split("=", 1)
            entries[key.strip()] = value.strip()
    return sections


def _blocks(sections: dict[str, dict[str, str]]) -> list[_Block]:
    """List the data blocks in file order. Raises KeyError or ValueError for a missing or wrong entry."""
    index = sections["DataSet"]
    places = {tuple(map(int, found.groups())): key for key in index if (found := _INDEX.fullmatch(key))}
    return [_block(sections[index[key]]) for _, key in sorted(places.items())]


def _block(entries: dict[str, str]) -> _Block:
    lines, points, bits = (int(entries[key]) for key in ("Lines", "Points", "SaveBits"))
    if not (1 <= lines <= _SIDE_MAX and 1 <= points <= _SIDE_MAX and bits in (8, 16, 32)):
        raise ValueError(f"{entries['Lines']} lines of {entries['Points']} points of {entries['SaveBits']} bits")
    if entries["SaveMode"] != "Binary" or entries["SaveOrder"] != "Intel":
        raise ValueError(f"data saved as {entries['SaveMode']}, {entries['SaveOrder']}")
    units = entries["Dim0Unit"], entries.get("Dim1Unit", "")
    channel = Channel(
        name=entries.get("Dim2Name", "unnamed"),
        frame=entries.get("Frame", "").removeprefix("Scan "),
        unit=entries["Dim2Unit"],
        # A force curve is in metres too, but over one length, time or voltage.
        is_image=units == ("m", "m"),
    )
    return _Block(
        channel=channel,
        lines=lines,
        points=points,
        bits=bits,
        signed=entries["SaveSign"] == "Signed",
        size_m=(float(entries.get("Dim1Range", "nan")), float(entries["Dim0Range"])),
        value_min=float(entries["Dim2Min"]),
        value_range=float(entries["Dim2Range"]),
    )
