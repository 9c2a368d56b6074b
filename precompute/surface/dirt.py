# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds dust, scars, shifted rows and spikes of a scan, and tries which steps remove them and keep the grating."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .height_map import HeightMap
from .least_squares_plane import Plane
from .periods import Wave
from .steps.defects import dust, outliers, scars
from .steps.lines import aligned_rows
from .steps.loss import loss_in_words, losses_of

# A defect covers at most this share of the scan; a larger one is relief.
_RELIEF_SHARE = 0.1
# A defect whose removal takes half of a wave's power is part of the grating.
_HALF = 0.5
# The side of the examined parts in pixels, so that a large scan takes no longer than a small one.
SIDE = 512
_ROWS_AT_ONCE = 256


def _streaks(height: np.ndarray, *, shifted: bool) -> np.ndarray:
    """Return the mask (rows, cols) of what looks like scars, either in rows that are shifted as a whole or in others.

    A shifted row does not stand out once the rows are aligned."""
    found = scars(height, 1.0)
    stay = found & scars(aligned_rows(height, "median"), 1.0)
    is_shifted = 2 * stay.sum(axis=1) < found.sum(axis=1)
    return found & (is_shifted if shifted else ~is_shifted)[:, None]


# The steps with their default numbers, and the pixels of the defects that they remove.
_FIND: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "dust": lambda height: dust(height, 5.0),
    "scars": lambda height: _streaks(height, shifted=False),
    "lines": lambda height: _streaks(height, shifted=True),
    "outliers": lambda height: outliers(height, 8.0),
}


@dataclass(frozen=True)
class Defect:
    """The pixels of a scan that a step would remove, or put right.

    share  share of the scan
    harm   the damage to the grating in words, "" for none
    loss   largest share of a wave's power that the step would take"""

    step: str
    share: float
    harm: str
    loss: float

    @property
    def belongs(self) -> bool:
        """Whether the defect is part of the grating."""
        return bool(self.harm) and self.loss >= _HALF


@dataclass(frozen=True)
class Spike:
    """The height of a scan that lies farthest off its relief.

    off_m     distance in metres above the highest, or below the lowest, of the other heights
    relief_m  range of the other heights in metres
    step      the step that removes the spike without harm to the grating; "" if there is none"""

    off_m: float
    relief_m: float
    step: str = ""

    @property
    def times(self) -> float:
        """The spike's distance as a multiple of the relief; 0 without relief."""
        return self.off_m / self.relief_m if self.relief_m else 0.0


@dataclass(frozen=True)
class Surface:
    """A scan, its levelling plane, its lowest and highest levelled height in metres, and its gratings."""

    height_map: HeightMap
    plane: Plane
    reach_m: tuple[float, float]
    gratings: Sequence[Wave]

    def around(self, place: tuple[int, int]) -> tuple[slice, slice]:
        """Return the rows and columns around a pixel, at most SIDE each."""
        shape = self.height_map.height_m.shape
        starts = [min(max(0, at - SIDE // 2), max(0, n - SIDE)) for at, n in zip(place, shape, strict=True)]
        return slice(starts[0], starts[0] + SIDE), slice(starts[1], starts[1] + SIDE)

    def levelled(self, part: tuple[slice, slice]) -> np.ndarray:
        """Return the levelled heights of a part."""
        return self.plane.level_part(self.height_map, part)

    def coarse(self) -> tuple[slice, slice]:
        """Return evenly spaced rows and columns of the whole scan, at most SIDE each."""
        rows, cols = (slice(None, None, -(-n // SIDE)) for n in self.height_map.height_m.shape)
        return rows, cols


def defects_of(surface: Surface) -> tuple[Defect, ...]:
    """Find the dust, the scars and the shifted rows of a scan."""
    rows, cols = surface.height_map.height_m.shape
    middle = surface.around((rows // 2, cols // 2))
    places = {"dust": surface.coarse(), "scars": middle, "lines": middle}
    found = (_tried(surface, step, part) for step, part in places.items())
    return tuple(each for each in found if each is not None)


def spike_of(surface: Surface, defects: Sequence[Defect], *, least: float) -> Spike:
    """Find the spike of a scan with these defects, and, if it exceeds `least` times the relief, its step."""
    coarse = surface.levelled(surface.coarse())
    dusty = any(each.step == "dust" and not each.belongs for each in defects)
    # If the grating itself looks like dust, only single pixels can be distinguished from it.
    off = _FIND["dust" if dusty else "outliers"](coarse)
    rest = coarse[np.isfinite(coarse) & ~off]
    if not rest.size:
        return Spike(0.0, 0.0)
    low, high = float(rest.min()), float(rest.max())
    spike = Spike(max(0.0, low - surface.reach_m[0], surface.reach_m[1] - high), high - low)
    if spike.times <= least:
        return spike
    return replace(spike, step=_removes(surface, _farthest(surface, low, high)))


def _tried(surface: Surface, step: str, part: tuple[slice, slice]) -> Defect | None:
    """Try a step on a part of the scan; None if it would remove nothing, or so much that it is the relief."""
    height = surface.levelled(part)
    mask = _FIND[step](height)
    share = float(mask.mean())
    if not 0 < share <= _RELIEF_SHARE or mask[np.isfinite(height)].all():
        return None
    dy, dx = (side * (each.step or 1) for side, each in zip(surface.height_map.pixel_size_m, part, strict=True))
    before = HeightMap(height, (dy, dx), surface.height_map.source)
    if step == "lines":
        after, holes = replace(before, height_m=aligned_rows(height, "median")), 0.0
    else:
        after, holes = replace(before, height_m=np.where(mask, np.nan, height)), share
    losses = losses_of(before, after, surface.gratings)
    return Defect(step, share, loss_in_words(losses, holes), max((loss for _, loss in losses), default=0.0))


def _farthest(surface: Surface, low: float, high: float) -> tuple[int, int]:
    """Return row and column of the height farthest above `high` or below `low`, both in metres."""
    off, place = -math.inf, (0, 0)
    for start in range(0, surface.height_map.rows, _ROWS_AT_ONCE):
        level = surface.levelled((slice(start, start + _ROWS_AT_ONCE), slice(None)))
        beyond = np.nan_to_num(np.maximum(level - high, low - level), nan=-math.inf)
        row, col = np.unravel_index(np.argmax(beyond), beyond.shape)
        if beyond[row, col] > off:
            off, place = float(beyond[row, col]), (start + int(row), int(col))
    return place


def _removes(surface: Surface, place: tuple[int, int]) -> str:
    """Name the step that removes the pixel at `place` without harm to the grating; "" if there is none."""
    part = surface.around(place)
    at = place[0] - part[0].start, place[1] - part[1].start
    height = surface.levelled(part)
    for step in ("dust", "outliers"):
        tried = _tried(surface, step, part) if _FIND[step](height)[at] else None
        if tried is not None and not tried.harm:
            return step
    return ""
