# SPDX-License-Identifier: GPL-3.0-or-later
"""What a scene asks of a bake: the region of (u, v, w) that it reaches, its lights' size, its pixels' size.

A needs file is JSON, every key optional but the format:

    {"format": 1,
     "u": [-0.4, 1.2], "v": [-0.3, 0.3], "w": [0.8, 2.0],   the region; by default [-2, 2], [-2, 2], [0, 2]
     "light_radius_deg": 0.265,                             angular radius of the smallest light
     "footprint": 0.01}                                     what (u, v) changes by across a pixel, at the least
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path

from ..base.failure import GratingError
from ..optics.region import Region

FORMAT = 1


_LIMITS = {"u": (-2.0, 2.0), "v": (-2.0, 2.0), "w": (0.0, 2.0)}


_WIDTH_MIN = 0.02


@dataclass(frozen=True)
class Needs:
    """The region of (u, v) and the range of w; the angular radius of the smallest light in radians; the change of
    (u, v) across a pixel."""

    region: Region = Region()
    w: tuple[float, float] = _LIMITS["w"]
    light_radius: float = 0.0
    footprint: float = 0.0

    @property
    def everything(self) -> bool:
        """Whether the region is the whole of (u, v, w)."""
        return (*self.region, self.w) == tuple(_LIMITS.values())

    @property
    def kernel(self) -> float:
        """The standard deviation in (u, v) under which a kernel is not seen: a disc's, a / 2, and half of a pixel's
        own, which a square of that width has as width / sqrt(12)."""
        return max(self.light_radius / 2, self.footprint / math.sqrt(12) / 2)

    def as_dict(self) -> dict:
        """As the file has it, every key."""
        region = {"u": list(self.region.u), "v": list(self.region.v), "w": list(self.w)}
        light = {"light_radius_deg": math.degrees(self.light_radius), "footprint": self.footprint}
        return {"format": FORMAT, **region, **light}


EVERYTHING = Needs()


def read_needs(path: Path) -> Needs:
    """The needs in a file. Raises GratingError that names the file, the key and what it may be."""
    try:
        record = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise GratingError(f"{path}: not a readable needs file ({error}); see docs/needs.md") from error
    return needs_of(record, str(path))


def needs_of(record: object, source: str) -> Needs:
    """The needs that a record of JSON holds. Raises GratingError that names the source, the key and what it may be."""
    if not isinstance(record, dict) or record.get("format") != FORMAT:
        raise GratingError(f'{source}: not a needs file of format {FORMAT}; it begins {{"format": {FORMAT}, ...')
    unknown = sorted(set(record) - {"format", *_LIMITS, "light_radius_deg", "footprint"})
    if unknown:
        raise GratingError(f"{source}: {unknown[0]}: no such key; there are u, v, w, light_radius_deg and footprint")
    u, v, w = (_range(source, name, record.get(name, limits)) for name, limits in _LIMITS.items())
    radius = math.radians(_size(source, "light_radius_deg", record, 90))
    return Needs(Region(u, v), w, radius, _size(source, "footprint", record, 4))


def _range(source: str, name: str, value) -> tuple[float, float]:
    low, high = _LIMITS[name]
    numbers = isinstance(value, (list, tuple)) and len(value) == 2 and all(isinstance(x, (int, float)) for x in value)
    if not (numbers and low <= value[0] and value[1] <= high and value[1] - value[0] >= _WIDTH_MIN):
        raise GratingError(f"{source}: {name}: give two numbers from {low:g} to {high:g}, at least {_WIDTH_MIN} apart")
    return float(value[0]), float(value[1])


def _size(source: str, name: str, record: dict, most: float) -> float:
    value = record.get(name, 0.0)
    if not (isinstance(value, (int, float)) and 0 <= value <= most):
        raise GratingError(f"{source}: {name}: give a number from 0 to {most}")
    return float(value)
