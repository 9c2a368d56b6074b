# SPDX-License-Identifier: GPL-3.0-or-later
"""Steps that find scars, outliers and dust, and turn their pixels into holes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...base.failure import GratingError
from ...colour.observer import WAVELENGTH_MIN_M
from ..height_map import HeightMap
from ..holes import fill_missing
from .loss import told_loss
from .plane import SIGMA_OF_MAD
from .step import Done

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
_ROWS_AT_ONCE = 256


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
            f"{what}:{number:g} would remove {share:.0%} of the scan, which then is its relief",
            f"give {what} a larger number than {number:g}",
        )
    if not share:
        return Done(height_map, "nothing found")
    holed = replace(height_map, height_m=np.where(mask, np.nan, height_map.height_m))
    return told_loss(height_map, holed, f"{share:.2%} of the pixels are made holes, which are filled", holes=share)


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
