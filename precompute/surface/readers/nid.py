# SPDX-License-Identifier: GPL-3.0-or-later
"""Nanosurf .nid: an INI-like header, then the channels as blocks of integers.

The header ends with "#!". Its [DataSet] section names, for every group and channel, the section that
describes a block; the blocks follow each other in that order, lines from the bottom of the scan to its top. A
value is a fraction of the range that its section declares.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...base.failure import GratingError
from ..height_map import HeightMap
from .channels import Channel, choose_channel

MAGIC = b"[DataSet]"


_HEADER_END = b"\n#!"


@dataclass(frozen=True)
class _Block:
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
        return self.lines * self.points * self.bits // 8

    def values(self, data: bytes, start: int) -> np.ndarray:
        """(lines, points) float64, top line first."""
        kind = f"<{'i' if self.signed else 'u'}{self.bits // 8}"
        raw = np.frombuffer(data, kind, self.lines * self.points, start).reshape(self.lines, self.points)
        fraction = raw[::-1] / 2.0**self.bits + (0.5 if self.signed else 0.0)
        return self.value_min + self.value_range * fraction


def read(source: str, channel: str | None) -> HeightMap:
    """Read one channel, the forward topography unless `channel` names another."""
    data = Path(source).read_bytes()
    end = data.find(_HEADER_END)
    if end < 0:
        raise GratingError(f"{source}: the header has no end, the file is truncated; copy it again")
    start = end + len(_HEADER_END)
    try:
        blocks = _blocks(_sections(data[:end].decode("utf-8", "replace")))
    except (KeyError, ValueError) as error:
        raise GratingError(
            f"{source}: the Nanosurf header is damaged or of an unknown kind ({error}); export the scan as .gwy"
        ) from error
    declared = sum(block.nbytes for block in blocks)
    if declared > len(data) - start:
        raise GratingError(
            f"{source}: the header declares {declared} bytes of data and {len(data) - start} "
            "are there, the file is truncated; copy it again"
        )
    channels = [block.channel for block in blocks]
    chosen = choose_channel(source, channels, channel)
    block = blocks[chosen]
    start += sum(earlier.nbytes for earlier in blocks[:chosen])
    return HeightMap(
        height_m=block.values(data, start),
        pixel_size_m=(block.size_m[0] / block.lines, block.size_m[1] / block.points),
        source=source,
        channel=block.channel.label,
        channels=tuple(each.label for each in channels),
    )


def _sections(header: str) -> dict[str, dict[str, str]]:
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
    """The data blocks in the order in which they lie in the file. Raises KeyError or ValueError."""
    index = sections["DataSet"]
    names = [
        index[f"Gr{group}-Ch{channel}"]
        for group in range(int(index["GroupCount"]))
        for channel in range(int(index[f"Gr{group}-Count"]))
        if f"Gr{group}-Ch{channel}" in index
    ]
    return [_block(sections[name]) for name in names]


def _block(entries: dict[str, str]) -> _Block:
    lines, points, bits = (int(entries[key]) for key in ("Lines", "Points", "SaveBits"))
    if lines < 1 or points < 1 or bits not in (8, 16, 32):
        raise ValueError(f"{lines} lines of {points} points of {bits} bits")
    if entries["SaveMode"] != "Binary" or entries["SaveOrder"] != "Intel":
        raise ValueError(f"data saved as {entries['SaveMode']}, {entries['SaveOrder']}")
    units = entries["Dim0Unit"], entries["Dim1Unit"]
    channel = Channel(
        name=entries.get("Dim2Name", "unnamed"),
        frame=entries.get("Frame", "").removeprefix("Scan "),
        # A spectroscopy curve has heights in metres too, but over time or voltage: no surface.
        unit=entries["Dim2Unit"] + ("" if units == ("m", "m") else f" over {' and '.join(units)}"),
    )
    return _Block(
        channel=channel,
        lines=lines,
        points=points,
        bits=bits,
        signed=entries["SaveSign"] == "Signed",
        size_m=(float(entries["Dim1Range"]), float(entries["Dim0Range"])),
        value_min=float(entries["Dim2Min"]),
        value_range=float(entries["Dim2Range"]),
    )
