# SPDX-License-Identifier: GPL-3.0-or-later
"""The functions of all steps that level and repair a scan.

They align scan lines; rotate, crop and mask; undo the rounding by the microscope's tip; subtract a plane or a
polynomial; turn scars, outliers and dust into holes; invert and scale heights; and calibrate the pixels. The alignment
of lines also removes a grating whose lines run along the scan lines, so it runs only on request."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...base.failure import GratingError
from ...colour.observer import WAVELENGTH_MIN_M
from ..height_map import HeightMap, fill_missing, fitted_plane, level_plane, read_between
from .step import Done, main_wave, told_loss


def align_lines(height_map: HeightMap, by: str) -> Done:
    """Shift each row; rows without heights stay. "median" gives each row the median zero. "difference" gives all rows
    the same typical difference from the row above, which slopes and particles hardly change."""
    aligned = aligned_rows(height_map.height_m, by)
    return told_loss(height_map, replace(height_map, height_m=aligned, periodic=False))


def aligned_rows(height: np.ndarray, by: str) -> np.ndarray:
    """Return heights (rows, cols) with shifted rows; see align_lines."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # from a missing row
        if by == "median":
            shift = np.nanmedian(height, axis=1)
        else:
            steps = _middle_mean(np.diff(height, axis=0))
            # Gentle rises and steep falls have a median difference in every row, which would add up to a tilt.
            shift = np.concatenate([[0.0], np.cumsum(np.nan_to_num(steps - np.nanmean(steps)))])
    return height - np.nan_to_num(shift)[:, None]


def _middle_mean(values: np.ndarray) -> np.ndarray:
    """Average the middle half of each row's finite values: (rows, cols) to (rows,), NaN for a row without any.

    A median would be too coarse: of heights in steps (8 bits, say) it is a step too, and the errors would add up over a
    thousand rows to more than the relief."""
    ordered = np.sort(values, axis=1)  # NaN last
    counts = np.isfinite(values).sum(axis=1)
    low, high = (counts // 4)[:, None], (counts - counts // 4)[:, None]
    place = np.arange(values.shape[1])
    return np.nanmean(np.where((place >= low) & (place < high), ordered, np.nan), axis=1)


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


def remove_tip(height_map: HeightMap, radius_nm: float) -> Done:
    """Erode the heights by a tip of this radius, after filling holes: the result is the highest surface that gives this
    scan (Villarrubia, Journal of Research of NIST 102, 1997).

    Near its apex a round tip is a paraboloid, r^2 / (2 R), so the erosion separates into the two axes."""
    height = fill_missing(height_map).height_m
    span = float(np.ptp(height))
    eroded = height
    for axis, pixel in enumerate(height_map.pixel_size_m):
        eroded = _eroded(eroded, axis, pixel**2 / (2e-9 * radius_nm), span)
    lowered = height - eroded
    touched = float((lowered > 1e-3 * span).mean())
    told = (
        f"{touched:.0%} of the pixels are lowered, by up to {lowered.max() * 1e9:.3g} nm; where the tip did not reach "
        "the ground, the ground stays unknown"
    )
    return Done(replace(height_map, height_m=eroded, periodic=False), told if touched else "no pixel is changed")


def _eroded(height: np.ndarray, axis: int, rise: float, span: float) -> np.ndarray:
    """Return the minimum, over shifts of k pixels along an axis, of the shifted height plus k^2 `rise`."""
    lowest = np.moveaxis(height, axis, 0).copy()
    line = np.moveaxis(height, axis, 0)
    # Farther out, the tip is above the whole relief and touches nothing.
    for k in range(1, min(len(line), int(np.sqrt(span / rise)) + 1)):
        np.minimum(lowest[k:], line[:-k] + k * k * rise, out=lowest[k:])
        np.minimum(lowest[:-k], line[k:] + k * k * rise, out=lowest[:-k])
    return np.moveaxis(lowest, 0, axis)


# Heights this many standard deviations off the plane are dust: in a normal distribution 1 in 370.
_CLIPPED_SIGMAS = 3.0
# The ratio of a normal distribution's standard deviation to the median of its absolute values.
SIGMA_OF_MAD = 1.4826
# Fits converge in a few rounds.
_ROUNDS_MAX = 20


def plane(height_map: HeightMap, fit: str) -> Done:
    """Subtract the plane through all heights (`fit` "least-squares"), or through the heights without dust ("robust").
    A periodic surface has no tilt and keeps its heights."""
    if height_map.periodic:
        return Done(height_map)
    return Done(level_plane(height_map) if fit == "least-squares" else _level_robust(height_map))


def _level_robust(height_map: HeightMap) -> HeightMap:
    """Fit a plane, exclude heights over three robust standard deviations off it, and repeat until nothing changes."""
    height = height_map.height_m
    kept = np.isfinite(height)
    for _ in range(_ROUNDS_MAX):
        level = height - sum(fitted_plane(np.where(kept, height, np.nan)))
        level -= np.nanmedian(level)
        off = np.abs(level)
        # If more than half of the heights lie exactly in one plane, all others count as dust.
        now = off <= _CLIPPED_SIGMAS * SIGMA_OF_MAD * np.nanmedian(off)
        if not now.any() or (now == kept).all():
            break
        kept = now
    return replace(height_map, height_m=height - sum(fitted_plane(np.where(kept, height, np.nan))))


def background(height_map: HeightMap, degree: float) -> Done:
    """Subtract the least-squares polynomial of x and y of a total degree from 1 to 5.

    The basis is products of Legendre polynomials, which are nearly orthogonal on the scan."""
    height = height_map.height_m
    powers = int(degree) + 1
    y, x = (
        np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, n) if n > 1 else np.zeros(1), powers - 1)
        for n in height.shape
    )
    finite = np.isfinite(height)
    used = np.add.outer(np.arange(powers), np.arange(powers)) < powers
    pairs = (finite @ (x[:, :, None] * x[:, None, :]).reshape(len(x), -1)).reshape(-1, powers, powers)
    normal = np.einsum("yi,yk,yjl->ijkl", y, y, pairs)[used][:, used]
    moment = (y.T @ (np.where(finite, height, 0.0) @ x))[used]
    coefficients = np.zeros((powers, powers))
    coefficients[used] = np.linalg.lstsq(normal, moment, rcond=None)[0]
    level = replace(height_map, height_m=height - y @ coefficients @ x.T, periodic=False)
    return told_loss(height_map, level)


# Defects cover at most this share of a scan; more is relief.
_SHARE_MAX = 0.1
# A scar, left by a tip that slipped, is at least 16 pixels long along a row and at most four rows wide.
_SCAR_LENGTH, _SCAR_ROWS = 16, 4
# A lower scar shifts the phase of violet light by less than 0.1 rad, which changes no colour.
_SCAR_FLOOR_M = 0.1 * WAVELENGTH_MIN_M / (4 * math.pi)
# The background under dust is the median of blocks, at most _BLOCKS along a side, each at least _LEAST_BLOCK pixels
# wide: wider than dust and most periods.
_BLOCKS = 16
_LEAST_BLOCK = 64
# A spike below this share of the relief's standard deviation changes no colour. Without this floor, a relief that is
# flat almost everywhere (8-bit steps) would have spikes wherever it is not.
_SPIKE_FLOOR = 0.02


def remove_scars(height_map: HeightMap, times: float) -> Done:
    """Turn scars into holes. A scar lies above, or below, both the row before and the row after it, by more than
    `times` the rms difference of neighbouring rows, and at least 3 nm."""
    return _removed(height_map, scars(height_map.height_m, times), "scars", times)


def remove_outliers(height_map: HeightMap, sigmas: float) -> Done:
    """Turn outliers into holes: single pixels that exceed, or undercut, all eight neighbours by more than `sigmas`
    robust standard deviations of the pixels' distance from the middle of their neighbours."""
    return _removed(height_map, outliers(height_map.height_m, sigmas), "outliers", sigmas)


def remove_dust(height_map: HeightMap, sigmas: float) -> Done:
    """Turn dust and scratches into holes: regions more than `sigmas` robust standard deviations of the relief above or
    below the background, grown to where the distance falls to half of that."""
    return _removed(height_map, dust(height_map.height_m, sigmas), "dust", sigmas)


def _removed(height_map: HeightMap, mask: np.ndarray, what: str, number: float) -> Done:
    share = float(mask.mean())
    if share > _SHARE_MAX:
        raise GratingError(
            height_map.source,
            f"{what}:{number:g} would remove {share:.0%} of the scan: this is its relief",
            f"give {what} a larger number than {number:g}",
        )
    if not share:
        return Done(height_map, "nothing found")
    holed = replace(height_map, height_m=np.where(mask, np.nan, height_map.height_m))
    return told_loss(height_map, holed, f"{share:.2%} of the pixels become holes, which are filled", holes=share)


def scars(height: np.ndarray, times: float) -> np.ndarray:
    """Return the mask (rows, cols) of scars; see remove_scars."""
    mask = np.zeros(height.shape, bool)
    if len(height) < 3:
        return mask
    threshold = max(_SCAR_FLOOR_M, times * np.sqrt(np.nanmean(np.diff(height, axis=0) ** 2)))
    # Comparisons with NaN are False: no scar.
    for up in (height, -height):
        for wide in range(1, min(_SCAR_ROWS, len(height) - 2) + 1):
            inside = up[1:-wide]
            for row in range(1, wide):
                inside = np.minimum(inside, up[1 + row : len(height) - wide + row])
            stands = inside - np.maximum(up[: -wide - 1], up[wide + 1 :]) > threshold
            long = _runs(stands, _SCAR_LENGTH)
            for row in range(wide):
                mask[1 + row : len(height) - wide + row] |= long
    return mask


def _runs(marked: np.ndarray, length: int) -> np.ndarray:
    """Keep the marks (rows, cols) in horizontal runs of at least `length` marks."""
    rows, cols = marked.shape
    kept = np.zeros_like(marked)
    if cols < length:
        return kept
    counts = np.concatenate([np.zeros((rows, 1), np.int32), np.cumsum(marked, axis=1, dtype=np.int32)], axis=1)
    whole = counts[:, length:] - counts[:, :-length] == length
    for row, start in zip(*np.nonzero(whole), strict=True):
        kept[row, start : start + length] = True
    return kept


def outliers(height: np.ndarray, sigmas: float) -> np.ndarray:
    """Return the mask (rows, cols) of outliers; see remove_outliers."""
    parts = [_of_neighbours(part) for part in _with_neighbours(height)]
    off, out = (np.concatenate(each) for each in zip(*parts, strict=True))
    known = off[np.isfinite(off)]
    if not known.size:
        return np.zeros(height.shape, bool)
    return out > sigmas * max(SIGMA_OF_MAD * np.median(known), _SPIKE_FLOOR * np.nanstd(height))


def _with_neighbours(height: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the pixels of a few rows and their neighbours (9, n, cols), the pixels fifth; NaN beyond the edges.

    All rows at once would take nine times the memory of the heights."""
    rows, cols = height.shape
    around = np.pad(height, 1, constant_values=np.nan)
    for start in range(0, rows, _ROWS_AT_ONCE):
        stop = min(rows, start + _ROWS_AT_ONCE)
        yield np.stack([around[start + dy : stop + dy, dx : dx + cols] for dy in range(3) for dx in range(3)])


def _of_neighbours(nine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return each pixel's distance from the middle between its highest and lowest neighbour, and its distance beyond
    them, both (n, cols); NaN if the pixel, or all neighbours, are missing."""
    pixel, others = nine[4], np.delete(nine, 4, axis=0)
    highest, lowest = np.fmax.reduce(others), np.fmin.reduce(others)
    return np.abs(pixel - (highest + lowest) / 2), np.maximum(pixel - highest, lowest - pixel)


def dust(height: np.ndarray, sigmas: float) -> np.ndarray:
    """Return the mask (rows, cols) of dust; see remove_dust."""
    off = np.abs(height - _ground(height))
    sigma = SIGMA_OF_MAD * np.nanmedian(off)
    return _grown(off > sigmas * sigma, off > sigmas / 2 * sigma)


def _ground(height: np.ndarray) -> np.ndarray:
    """Return the background (rows, cols) of a surface: medians of blocks, linear between the blocks' middles."""
    edges = [np.linspace(0, n, max(1, min(_BLOCKS, n // _LEAST_BLOCK)) + 1).astype(int) for n in height.shape]
    medians = np.array([
        [_median(height[top:bottom, left:right]) for left, right in zip(edges[1][:-1], edges[1][1:], strict=True)]
        for top, bottom in zip(edges[0][:-1], edges[0][1:], strict=True)
    ])  # fmt: skip
    if np.isnan(medians).any():
        medians = fill_missing(HeightMap(medians, (1.0, 1.0), "blocks")).height_m
    along_y, along_x = (_between(edge) for edge in edges)
    return along_y @ medians @ along_x.T


def _median(block: np.ndarray) -> float:
    finite = block[np.isfinite(block)]
    return float(np.median(finite)) if finite.size else np.nan


def _between(edges: np.ndarray) -> np.ndarray:
    """Return the weights (n, blocks) of the blocks' values in n pixels, linear between the blocks' middles."""
    middles = (edges[:-1] + edges[1:] - 1) / 2
    return np.array([np.interp(np.arange(edges[-1]), middles, unit) for unit in np.eye(len(middles))]).T


def _grown(seeds: np.ndarray, allowed: np.ndarray) -> np.ndarray:
    """Grow the seeds (rows, cols) to the connected pixels of `allowed`, and one pixel around them."""
    grown, count = seeds, -1
    while grown.sum() != count:
        count = grown.sum()
        grown = (_spread(grown) & allowed) | seeds
    return _spread(grown)


def _spread(mask: np.ndarray) -> np.ndarray:
    """Add the four neighbours of each pixel to a mask."""
    spread = mask.copy()
    spread[1:] |= mask[:-1]
    spread[:-1] |= mask[1:]
    spread[:, 1:] |= mask[:, :-1]
    spread[:, :-1] |= mask[:, 1:]
    return spread


# A microscope's scale is off by some percent. The first limit gives a warning, the second (another grating) an error.
_FACTOR_USUAL, _FACTOR_MAX = 1.1, 1.5


def invert(height_map: HeightMap) -> Done:
    """Invert heights, for the scan of a replica or a stamp."""
    return Done(replace(height_map, height_m=-height_map.height_m))


def scale_heights(height_map: HeightMap, factor: float) -> Done:
    """Multiply all heights."""
    return Done(replace(height_map, height_m=height_map.height_m * factor))


def calibrate(height_map: HeightMap, period_nm: float) -> Done:
    """Scale the pixels so that the grating has its known period."""
    measured_m = main_wave(height_map, "calibrate").period_m
    factor = period_nm * 1e-9 / measured_m
    if not 1 / _FACTOR_MAX <= factor <= _FACTOR_MAX:
        raise GratingError(
            height_map.source,
            f"calibrate: its grating measures {measured_m * 1e9:.4g} nm, far from {period_nm:g} nm",
            "give the period of that grating, or leave calibrate out",
        )
    dy, dx = (side * factor for side in height_map.pixel_size_m)
    told = f"the period of {measured_m * 1e9:.4g} nm is now {period_nm:g} nm: pixels are {factor:.4g} times as large"
    unusual = not 1 / _FACTOR_USUAL <= factor <= _FACTOR_USUAL
    if unusual:
        told += f"; a microscope errs by less, so check that this is the grating of {period_nm:g} nm"
    return Done(replace(height_map, pixel_size_m=(dy, dx)), told, warns=unusual)
