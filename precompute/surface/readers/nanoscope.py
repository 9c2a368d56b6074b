# SPDX-License-Identifier: GPL-3.0-or-later
r"""Reader of Bruker NanoScope (.spm, .000 to .999): a text header of lists, then the channels as blocks of integers.

A list begins with a line "\*NAME list"; its entries are lines "\KEY: VALUE". Each "Ciao image list" describes a
channel. An entry "@2:Z scale: V [Sens. Zsens] (0.005 V/LSB) 2.91 V" gives the value of the whole integer range; the
bracket names the entry, in the scanner's or the scan's list, with the sensitivity in nanometres per volt. Lines run
from the scan's bottom up. Keys are compared in lower case, since versions differ ("Scan size" in 5, "Scan Size" in 7).
(Format: Bruker, "NanoScope file header", since version 4.3; counts and sides: Gwyddion's module nanoscope.)"""

from __future__ import annotations

import math
import re
from functools import partial
from typing import BinaryIO

import numpy as np

from .scan_file import Block, Channel, ScanReader, StoredMap, decoded, in_base_units

# A list of images, of electrochemistry, or of force curves.
_BEGINNINGS = b"\\*File list", b"\\*EC File list", b"\\*Force file list"
_END = b"\\*File list end"
# The longest header in bytes; most have 40 KB.
_HEADER_MAX = 1 << 20
_SOFT_SCALE = re.compile(r"\[([^\]]*)\]")
# A unit may contain brackets: "log(Arb)".
_LAST_NUMBER = re.compile(r"(?<![\w.])([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(\S*)\s*$")
# How the software context begins for force curves, and ends for profiles of unequal lengths.
_CURVE_CONTEXT, _PROFILE_CONTEXT = "FOL", "VAR"
# The first version that always stores 32 bits.
_VERSION, _OF_32_BITS = re.compile("0x[0-9a-f]{1,8}", re.IGNORECASE), 0x09200000


def _lists(file: BinaryIO) -> list[tuple[str, dict[str, str]]]:
    """Read the header's lists in order, names and keys in lower case. Raises ValueError if the header has no end."""
    file.seek(0)
    header = file.read(_HEADER_MAX)
    end = header.lower().find(_END.lower(), len(_BEGINNINGS[0]))
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
    context = common.get("start context", "")
    is_image = not (
        lists[0][0].startswith("force")
        or context.startswith(_CURVE_CONTEXT)
        or context.endswith(_PROFILE_CONTEXT)
        or common.get("operating mode") == "Force"
    )
    return [_map(file, entries, common, is_image=is_image) for entries in images]


def _map(file: BinaryIO, entries: dict[str, str], common: dict[str, str], *, is_image: bool) -> StoredMap:
    shape, stored_bytes = _grid(entries, common)
    try:
        unit, scale = _scale(entries, common)
    except (KeyError, ValueError):  # the other channels may be usable
        unit, scale = "an unknown unit", 1.0
    block = Block(int(entries["data offset"]), shape, f"<i{stored_bytes}").within(file)
    # The header's bytes per pixel set the scale; stored integers may be longer.
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


def _grid(entries: dict[str, str], common: dict[str, str]) -> tuple[tuple[int, int], int]:
    """Return (rows, cols) and the bytes of a value.

    The data's length tells whether the image's own counts hold, or the whole scan's. If it fits neither, the data are
    longer than needed. Raises ValueError if they are shorter."""
    length, shapes = int(entries["data length"]), (_declared(entries), _scanned(entries, common))
    version = _VERSION.match(common.get("version", ""))
    usual = 4 if version and int(version[0], 16) >= _OF_32_BITS else 2
    for shape, nbytes in ((shapes[0], usual), (shapes[1], usual), (shapes[0], 6 - usual)):
        if length == nbytes * math.prod(shape):
            return shape, nbytes
    fitting = [shape for shape in shapes if length > usual * math.prod(shape)]
    if not fitting:
        raise ValueError(f"{length} bytes for {shapes[0][0]} x {shapes[0][1]} values")
    return max(fitting, key=math.prod), usual


def _declared(entries: dict[str, str]) -> tuple[int, int]:
    """Return an image's own (rows, cols)."""
    return int(entries["number of lines"]), int(entries["samps/line"])


def _scanned(entries: dict[str, str], common: dict[str, str]) -> tuple[int, int]:
    """Return (rows, cols) of the whole scan; the image's own if the scan list has none."""
    rows, cols = _declared(entries)
    return int(common.get("lines", rows)), int(common.get("samps/line", str(cols)).split()[0])


def _sides(entries: dict[str, str], common: dict[str, str], shape: tuple[int, int]) -> tuple[float, float]:
    """Read (Ly, Lx) in metres of an image of `shape` from "500 250 nm" (width, height) or "500 nm", a square.

    The height is of as many lines as the scan's aspect ratio demands, unless the image's own ratio is 1:1. Newer
    headers give the height of the whole scan ("Slow Axis Size"), and the second number is wrong."""
    width, height = _lengths(entries.get("scan size") or common["scan size"])
    declared, scanned = _declared(entries), _scanned(entries, common)
    slow = common.get("slow axis size")
    if slow is not None:
        # As a ratio, since an image may be cut out of the scan.
        height = width * _lengths(slow)[0] / _lengths(common["scan size"])[0]
    if shape != declared:
        return height if slow is not None else height * shape[0] / declared[0], width * shape[1] / declared[1]
    if _is_square(entries):
        return height, width
    if slow is not None:
        return height * min(1.0, shape[0] / scanned[0]), width
    return height * shape[0] / (scanned[0] if _is_square(common) else shape[1]), width


def _lengths(text: str) -> tuple[float, float]:
    """Read width and height in metres; a single number is both."""
    *numbers, unit = text.split()
    size, base = in_base_units(unit)
    if base != "m" or len(numbers) not in (1, 2):
        raise ValueError(f"a scan size of '{text}'")
    return float(numbers[0]) * size, float(numbers[-1]) * size


def _is_square(entries: dict[str, str]) -> bool:
    """Whether a list's aspect ratio is 1:1, or begins with 1: Gwyddion reads only the first number."""
    try:
        first = float(entries.get("aspect ratio", "").partition(":")[0])
    except ValueError:
        return True
    return first <= 0 or first == 1


def _begins(beginning: bytes) -> bool:
    return beginning.startswith(_BEGINNINGS)


NANOSCOPE = ScanReader(
    "Bruker NanoScope", (".spm", ".di", *(f".{number:03}" for number in range(1000))), _begins, _maps
)
