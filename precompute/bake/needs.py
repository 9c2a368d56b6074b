# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene's needs of a bake: the region of (u, v, w) that it reaches, and the size of its lights and pixels.

A needs file is JSON. Every key but the format is optional:

    {"format": 1,
     "u": [-0.4, 1.2], "v": [-0.3, 0.3], "w": [0.8, 2.0],   the region; by default [-2, 2], [-2, 2], [0, 2]
     "light_radius_deg": 0.265,                             angular radius of the smallest light, in degrees
     "footprint": 0.01,                                     the least change of (u, v) across a pixel
     "measured": {...}}                                     how the file was made; a bake ignores it

docs/scans.md describes them for users.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..base.failure import GratingError
from ..base.strict import read_json
from ..optics.plate import NO_PLATE, w_inside_plate
from ..optics.region import Region

# The version of needs files. A reader refuses all others.
FORMAT = 1
# (u, v, w) is the sum of two unit vectors, both above the surface.
_LIMITS = {"u": (-2.0, 2.0), "v": (-2.0, 2.0), "w": (0.0, 2.0)}
# The least width of a range: about three standard deviations of the kernel of a coherence of 34 um.
WIDTH_MIN = 0.02


@dataclass(frozen=True)
class Needs:
    """A scene's needs of a bake.

    region        the region of (u, v)
    w             the range of w
    light_radius  the angular radius of the smallest light, in radians
    footprint     the least change of (u, v) across a pixel"""

    region: Region = Region()
    w: tuple[float, float] = _LIMITS["w"]
    light_radius: float = 0.0
    footprint: float = 0.0

    @property
    def everything(self) -> bool:
        """Whether the region is the whole of (u, v, w)."""
        return (*self.region, self.w) == tuple(_LIMITS.values())

    @property
    def is_reached(self) -> bool:
        """Whether two directions above the surface, whose sum is at most 2 long, can have u, v and w in the ranges."""
        nearest = (max(low, -high, 0.0) for low, high in (*self.region, self.w))
        return sum(each**2 for each in nearest) < 4

    @property
    def kernel(self) -> float:
        """The standard deviation in (u, v) below which the width of a kernel is invisible.

        A light's disc of angular radius a blurs with a standard deviation of a / 2. A pixel of side b has the standard
        deviation b / sqrt(12) along an axis; half of it is used. The larger of the two counts."""
        return max(self.light_radius / 2, self.footprint / math.sqrt(12) / 2)

    def inside_plate(self, ior: float) -> "Needs":
        """The needs of the directions inside a plate over the relief. A range of w from 0 keeps its end, although no
        light inside has so small a w: a material with a low Height Scale reads the table there."""
        if ior == NO_PLATE:
            return self
        u, v = ((low / ior, high / ior) for low, high in self.region)
        low, high = w_inside_plate(self.w, ior)
        w = (low if self.w[0] > 0 else 0.0, high)
        return Needs(Region(u, v), w, self.light_radius / ior, self.footprint / ior)

    def as_dict(self) -> dict[str, Any]:
        """The needs as in a file, with every key."""
        region = {"u": list(self.region.u), "v": list(self.region.v), "w": list(self.w)}
        light = {"light_radius_deg": math.degrees(self.light_radius), "footprint": self.footprint}
        return {"format": FORMAT, **region, **light}


# The needs of an unknown scene.
EVERYTHING = Needs()


def read_needs(path: Path) -> Needs:
    """Read the needs in a file. Raises GratingError with the file, the key, and the allowed values."""
    return needs_of(read_json(path, "write one by the verb `needs` inside Blender"), str(path))


def needs_of(record: object, source: str) -> Needs:
    """Convert a JSON record to needs. Raises GratingError with `source`, the key, and the allowed values."""
    if not isinstance(record, dict) or not _is_number(record.get("format")) or record["format"] != FORMAT:
        raise GratingError(source, f"not a needs file of format {FORMAT}", f'it begins {{"format": {FORMAT}, ...')
    if not isinstance(record.get("measured", {}), dict):
        raise GratingError(
            source, "measured: is not an object", "give an object that says how the file was made, or leave it out"
        )
    unknown = sorted(set(record) - {"format", *_LIMITS, "light_radius_deg", "footprint", "measured"})
    if unknown:
        raise GratingError(
            source, f"{unknown[0]:.40}: no such key", "there are u, v, w, light_radius_deg and footprint"
        )
    u, v, w = (_range(source, name, record.get(name, limits)) for name, limits in _LIMITS.items())
    radius = math.radians(_size(source, "light_radius_deg", record, 90))
    return Needs(Region(u, v), w, radius, _size(source, "footprint", record, 4))


def _range(source: str, name: str, value: Any) -> tuple[float, float]:
    low, high = _LIMITS[name]
    numbers = isinstance(value, (list, tuple)) and len(value) == 2 and all(_is_number(x) for x in value)
    if not (numbers and low <= value[0] and value[1] <= high and value[1] - value[0] >= WIDTH_MIN):
        raise GratingError(
            source,
            f"{name}: cannot be {value!r:.30}",
            f"give two numbers from {low:g} to {high:g}, at least {WIDTH_MIN} apart",
        )
    return float(value[0]), float(value[1])


def _size(source: str, name: str, record: Mapping[str, Any], most: float) -> float:
    value = record.get(name, 0.0)
    if not (_is_number(value) and 0 <= value <= most):
        raise GratingError(source, f"{name}: cannot be {value!r:.30}", f"give a number from 0 to {most}")
    return float(value)


def _is_number(value: object) -> bool:
    """Whether a JSON value is a number; excludes True, which is an int in Python."""
    return type(value) in (int, float)
