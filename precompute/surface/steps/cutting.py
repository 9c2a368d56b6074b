# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps that rotate, crop and mask a scan."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ...base.failure import GratingError
from ..cubic_convolution import read_between
from ..height_map import HeightMap
from ..holes import fill_missing
from .main_wave import main_wave
from .step import Done

_ROWS_AT_ONCE = 256
# The fewest pixels of a scan's side.
_LEAST_PIXELS = 8


def rotate(height_map: HeightMap, degrees: float) -> Done:
    """Rotate the surface counterclockwise, from T towards B. Quarter turns move the pixels. Other angles fill holes,
    interpolate, and keep the largest complete rectangle with the scan's proportions."""
    quarters = degrees / 90
    if quarters == int(quarters):
        turned = np.rot90(height_map.height_m, int(quarters))
        pixel = height_map.pixel_size_m if quarters % 2 == 0 else height_map.pixel_size_m[::-1]
        return Done(replace(height_map, height_m=turned, pixel_size_m=pixel))
    height = fill_missing(height_map).height_m
    pixel, (ly, lx) = height_map.pixel_size_m, height_map.size_m
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    share = min(lx / (lx * abs(cos) + ly * abs(sin)), ly / (lx * abs(sin) + ly * abs(cos)))
    shape = tuple(int(share * n) for n in height.shape)
    if min(shape) < _LEAST_PIXELS:
        raise GratingError(height_map.source, f"rotate leaves {shape[1]} x {shape[0]} pixels", "give a larger scan")
    # Positions of the new pixels from the middle, in metres: x along T, y along -B.
    y, x = ((np.arange(n) - (n - 1) / 2) * side for n, side in zip(shape, pixel, strict=True))
    turned = np.empty(shape)
    for start in range(0, shape[0], _ROWS_AT_ONCE):
        part = y[start : start + _ROWS_AT_ONCE, None]
        row = (part * cos + x * sin) / pixel[0] + (height.shape[0] - 1) / 2
        col = (x * cos - part * sin) / pixel[1] + (height.shape[1] - 1) / 2
        turned[start : start + _ROWS_AT_ONCE] = read_between(height, row, col)
    kept = f"{shape[1]} x {shape[0]} of {height_map.cols} x {height_map.rows} pixels are kept"
    return Done(replace(height_map, height_m=turned, periodic=False), kept)


def crop(height_map: HeightMap, *sides_um: float) -> Done:
    """Keep a rectangle: left, top, right and bottom in micrometres from the scan's left and top edge."""
    part = _part(height_map, "crop", sides_um)
    cut = height_map.height_m[part]
    if min(cut.shape) < _LEAST_PIXELS:
        size = f"{cut.shape[1]} x {cut.shape[0]}"
        raise GratingError(height_map.source, f"crop leaves {size} pixels", "give a larger part")
    return Done(_cut(height_map, cut, "crop"))


def mask(height_map: HeightMap, *sides_um: float) -> Done:
    """Turn a rectangle into a hole: left, top, right and bottom in micrometres from the left and top edge."""
    height = height_map.height_m.copy()
    height[_part(height_map, "mask", sides_um)] = np.nan
    return Done(_cut(height_map, height, "mask"))


def whole_periods(height_map: HeightMap) -> Done:
    """Keep a whole number of the grating's periods along T and along B, in the middle of the scan."""
    wave = main_wave(height_map, "periods")
    angle = math.radians(wave.angle_deg)
    kept = []
    for count, side, share in zip(
        height_map.height_m.shape, height_map.pixel_size_m, (math.sin(angle), math.cos(angle)), strict=True
    ):
        # Periods along this axis: less than one if the grating's lines run along it.
        repeats = math.floor(count * side * abs(share) / wave.period_m)
        length = round(repeats * wave.period_m / (abs(share) * side)) if repeats else count
        start = (count - length) // 2
        kept.append(slice(start, start + length))
    cut = height_map.height_m[tuple(kept)]
    told = f"{cut.shape[1]} x {cut.shape[0]} of {height_map.cols} x {height_map.rows} pixels are kept"
    return Done(_cut(height_map, cut, "periods"), told)


def _part(height_map: HeightMap, what: str, sides_um: tuple[float, ...]) -> tuple[slice, slice]:
    """Return the pixels whose centres lie in a rectangle."""
    left, top, right, bottom = sides_um
    found = []
    for low, high, pixel, count in ((top, bottom, height_map.pixel_size_m[0], height_map.rows),
                                    (left, right, height_map.pixel_size_m[1], height_map.cols)):  # fmt: skip
        first, last = (math.ceil(edge * 1e-6 / pixel - 0.5) for edge in (low, high))
        found.append(slice(max(0, first), min(count, last)))
        if found[-1].start >= found[-1].stop:
            ly, lx = (side * 1e6 for side in height_map.size_m)
            raise GratingError(
                height_map.source,
                f"{what}: no pixel is between {low:g} and {high:g} um",
                f"give LEFT:TOP:RIGHT:BOTTOM within the {lx:.4g} x {ly:.4g} um of the scan",
            )
    return found[0], found[1]


def _cut(height_map: HeightMap, height: np.ndarray, what: str) -> HeightMap:
    if np.isnan(height).all():
        raise GratingError(height_map.source, f"{what} leaves no height", "give another part")
    return replace(height_map, height_m=height, periodic=False)
