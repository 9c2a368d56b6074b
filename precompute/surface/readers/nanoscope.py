# SPDX-License-Identifier: GPL-3.0-or-later
r"""Reader of Bruker NanoScope (.spm, .000 to .999): a text header of lists, then the channels as blocks of integers.

A list begins with a line "\*NAME list"; its entries are lines "\KEY: VALUE". Each "Ciao image list" describes a
channel. An entry "@2:Z scale: V [Sens. Zsens] (0.005 V/LSB) 2.91 V" gives the value of the whole integer range; the
bracket names the entry, in the scanner's or the scan's list, with the sensitivity in nanometres per volt. Lines run
from the scan's bottom up. Keys are compared in lower case, since versions differ ("Scan size" in 5, "Scan Size" in 7).
(Format: Bruker, "NanoScope file header", since version 4.3.)"""

from __future__ import annotations

import re
from functools import partial
from typing import BinaryIO

import numpy as np

from .channels import Channel
from .number_text import decoded
from .scan_file import Block, ScanReader, StoredMap
from .units import in_base_units

_IMAGES, _CURVES = b"\\*File list", b"\\*Force file list"
_END = b"\\*File list end"
# The longest header in bytes; most have 40 KB.
_HEADER_MAX = 1 << 20
_SOFT_SCALE = re.compile(r"\[([^\]]*)\]")
# A unit may contain brackets: "log(Arb)".
_LAST_NUMBER = re.compile(r"(?<![\w.])([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(\S*)\s*$")
# The software context of force curves.
_CURVE_CONTEXT = "FOL"


def _lists(file: BinaryIO) -> list[tuple[str, dict[str, str]]]:
    """Read the header's lists in order, names and keys in lower case. Raises ValueError if the header has no end."""
    file.seek(0)
    header = file.read(_HEADER_MAX)
    end = header.lower().find(_END.lower(), len(_IMAGES))
    if end < 0:
        raise ValueError("the header has no end")
    lists: list[tuple[str, dict[str, str]]] = []
    for line in decoded(header[:end]).splitlines():
        if line.startswith("\\*"):
            lists.append((line[2:].strip().lower(), {}))
        elif line.startswith("\\") and lists:
            key, _, value = line[1:].partition(": ")
            lists[-1][1][key.strip().lower()] = value.strip()
    return lists


def _maps(file: BinaryIO) -> list[StoredMap]:
    lists = _lists(file)
    images = [entries for name, entries in lists if name.endswith("image list")]
    common: dict[str, str] = {}
    for name, entries in lists:
        if not name.endswith("image list"):
            common |= entries
    is_image = not (
        lists[0][0].startswith("force")
        or common.get("start context", "").startswith(_CURVE_CONTEXT)
        or common.get("operating mode") == "Force"
    )
    return [_map(file, entries, common, is_image=is_image) for entries in images]


def _map(file: BinaryIO, entries: dict[str, str], common: dict[str, str], *, is_image: bool) -> StoredMap:
    shape = int(entries["number of lines"]), int(entries["samps/line"])
    try:
        unit, scale = _scale(entries, common)
    except (KeyError, ValueError):  # the other channels may be usable
        unit, scale = "an unknown unit", 1.0
    # The header's bytes per pixel set the scale; stored integers may be longer.
    stored_bytes = int(entries["data length"]) // max(1, shape[0] * shape[1])
    if stored_bytes not in (2, 4):
        raise ValueError(f"{entries['data length']} bytes for {shape[0]} x {shape[1]} values")
    block = Block(int(entries["data offset"]), shape, f"<i{stored_bytes}").within(file)
    scale /= 2.0 ** (8 * int(entries.get("bytes/pixel", "2")))
    channel = Channel(_name(entries), entries.get("line direction", "").lower(), unit, is_image)
    height_m, width_m = _sides(entries, common, shape)
    return StoredMap(channel, shape, (height_m / shape[0], width_m / shape[1]), partial(_values, block, scale))


def _values(block: Block, scale: float, file: BinaryIO) -> np.ndarray:
    return block.scaled(file, scale=scale)[::-1]


def _name(entries: dict[str, str]) -> str:
    """Read the name in the brackets of 'S [Height] "Height"', or in the quotes if the brackets are empty."""
    for version in ("@2", "@3", "@4"):
        if (text := entries.get(f"{version}:image data")) is not None:
            bracket = _SOFT_SCALE.search(text)
            return bracket[1] if bracket and bracket[1] else text.partition('"')[2].strip('"')
    return entries.get("image data", "unnamed").strip('"')


def _scale(entries: dict[str, str], common: dict[str, str]) -> tuple[str, float]:
    """Return the unit of the values, "m" for heights, and the value of the whole integer range."""
    text = entries["@4:z scale"] if "@4:z scale" in entries else entries["@2:z scale"]
    value, unit = _quantity(text)
    soft = _SOFT_SCALE.search(text)
    sensitivity = common.get(f"@{soft[1].lower()}") if soft else None
    if sensitivity is not None:
        factor, per = _quantity(sensitivity)
        if "/" in per:
            unit_m, base = in_base_units(per.partition("/")[0])
            against = in_base_units(per.partition("/")[2])
            own = in_base_units(unit)
            if own[1] == against[1]:
                return base, value * own[0] / against[0] * factor * unit_m
    size, base = in_base_units(unit)
    return base, value * size


def _quantity(text: str) -> tuple[float, str]:
    """Read the number and the unit at the end of an entry."""
    found = _LAST_NUMBER.search(text)
    if found is None:
        raise ValueError(f"no number in '{text}'")
    return float(found[1]), found[2]


def _sides(entries: dict[str, str], common: dict[str, str], shape: tuple[int, int]) -> tuple[float, float]:
    """Read (Ly, Lx) in metres from "500 250 nm" (width, height) or "500 nm"."""
    text = entries.get("scan size") or common["scan size"]
    *numbers, unit = text.split()
    size, base = in_base_units(unit)
    if base != "m" or len(numbers) not in (1, 2):
        raise ValueError(f"a scan size of '{text}'")
    width = float(numbers[0]) * size
    # A single number implies square pixels.
    return (float(numbers[1]) * size if len(numbers) == 2 else width * shape[0] / shape[1]), width


def _begins(beginning: bytes) -> bool:
    return beginning.startswith((_IMAGES, _CURVES))


NANOSCOPE = ScanReader(
    "Bruker NanoScope", (".spm", ".di", *(f".{number:03}" for number in range(1000))), _begins, _maps
)
