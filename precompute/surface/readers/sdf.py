# SPDX-License-Identifier: GPL-3.0-or-later
"""Reader of surface data files .sdf (ISO 25178-71), text or binary: a header in metres, then heights by profile."""

from __future__ import annotations

import struct
from functools import partial
from typing import BinaryIO

import numpy as np

from .scan_file import Block, Channel, ScanReader, StoredMap, numbers_of, read_exactly, read_text

_TEXT, _BINARY = (b"aISO-1.0", b"aBCR-1.0"), (b"bISO-1.0", b"bBCR-1.0")
_HEAD = struct.Struct("<8s10s12s12s2H4d3B")
_HEAD_NAMES = ("NumPoints", "NumProfiles", "Xscale", "Yscale", "Zscale", "Zresolution", "Compression", "DataType")
_KINDS = {0: "<u1", 1: "<u2", 2: "<u4", 3: "<f4", 4: "<i1", 5: "<i2", 6: "<i4", 7: "<f8"}
# The integer of an unmeasured point, by number type.
_MISSING = {1: 2**16 - 1, 2: 2**32 - 1, 5: -(2**15), 6: -(2**31)}
# The float of an unmeasured point is NaN or the largest float. Texts may round it, even to infinity.
_LARGEST = {3: 0.999 * np.finfo("f4").max, 7: 0.999 * np.finfo("f8").max}


def _maps(file: BinaryIO) -> list[StoredMap]:
    file.seek(0)
    if file.read(len(_BINARY[0])) in _BINARY:
        found = _HEAD.unpack(read_exactly(file, 0, _HEAD.size))
        facts, body = dict(zip(_HEAD_NAMES, found[4:], strict=False)), ""
    else:
        head, _, rest = read_text(file).partition("*")
        pairs = (line.partition("=") for line in head.splitlines()[1:])
        entries = {key.strip(): value.strip() for key, _, value in pairs}
        facts, body = {name: float(entries.get(name, "0")) for name in _HEAD_NAMES}, rest.partition("*")[0]
    shape, kind = (int(facts["NumProfiles"]), int(facts["NumPoints"])), int(facts["DataType"])
    if facts["Compression"] or kind not in _KINDS:
        raise ValueError(f"compression {facts['Compression']:g}, numbers of type {kind}")
    if body:
        load = partial(_from_text, body, shape, facts["Zscale"], kind)
    else:
        load = partial(_from_block, Block(_HEAD.size, shape, _KINDS[kind]).within(file), facts["Zscale"], kind)
    return [StoredMap(Channel("height", "", "m"), shape, (float(facts["Yscale"]), float(facts["Xscale"])), load)]


def _from_text(body: str, shape: tuple[int, int], scale: float, kind: int, file: BinaryIO) -> np.ndarray:
    return _heights(numbers_of(body.replace("BAD", "nan")).reshape(shape), scale, kind)


def _from_block(block: Block, scale: float, kind: int, file: BinaryIO) -> np.ndarray:
    return _heights(block.read(file), scale, kind)


def _heights(stored: np.ndarray, scale: float, kind: int) -> np.ndarray:
    """Convert stored numbers to heights, NaN for unmeasured points."""
    heights = stored * np.float64(scale)
    if kind in _MISSING:
        heights[stored == _MISSING[kind]] = np.nan
    if kind in _LARGEST:
        heights[np.abs(stored) >= _LARGEST[kind]] = np.nan
    return heights


def _begins(beginning: bytes) -> bool:
    return beginning.startswith(_TEXT + _BINARY)


SDF = ScanReader("ISO 25178 SDF", (".sdf",), _begins, _maps)
