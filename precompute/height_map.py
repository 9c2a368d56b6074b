# SPDX-License-Identifier: GPL-3.0-or-later
"""A measured or synthetic relief, and the two repairs that every use of it needs."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .failure import GratingError

# Sweeps per level of the coarse-to-fine fill: each level starts from an already smooth guess, so that a few
# sweeps only round off the steps of the coarser grid.
_FILL_SWEEPS = 8
# Singular values below this share of the largest mean that the pixels lie on a line or a point; the plane is
# then the flattest of those that fit.
_RANK_TOLERANCE = 1e-12
_ROWS_AT_ONCE = 256


@dataclass(frozen=True, eq=False)
class HeightMap:
    """Heights over a rectangle.

    height_m      (rows, cols) float64 in metres, positive outward, NaN where nothing was measured; columns
                  run along the tangent T, row 0 is the top of the scan (rows run along -B); read-only
    pixel_size_m  (dy, dx) in metres
    source        what it was read from: a path, or "sample:NAME"
    channel       the instrument's name of these heights; channels: all that the source offers
    periodic      the edges wrap exactly (synthetic surfaces)

    Raises GratingError unless the heights are a two-dimensional array with at least one finite value and no
    infinite one, and the pixel sizes are positive and finite.
    """

    height_m: np.ndarray
    pixel_size_m: tuple[float, float]
    source: str
    channel: str = ""
    channels: tuple[str, ...] = ()
    periodic: bool = False

    def __post_init__(self) -> None:
        height = np.asarray(self.height_m, dtype=np.float64).view()
        if height.ndim != 2 or height.size == 0:
            raise GratingError(f"{self.source}: heights of shape {height.shape} are no map; give rows by columns")
        pixel = tuple(float(side) for side in self.pixel_size_m)
        if len(pixel) != 2 or not all(math.isfinite(side) and side > 0 for side in pixel):
            raise GratingError(f"{self.source}: pixel size {pixel} m is not positive; give the real size of the scan")
        if np.isinf(height).any():
            raise GratingError(f"{self.source}: some heights are infinite; mark them as missing (NaN)")
        if np.isnan(height).all():
            raise GratingError(f"{self.source}: every height is missing; choose another channel or scan")
        height.flags.writeable = False
        object.__setattr__(self, "height_m", height)
        object.__setattr__(self, "pixel_size_m", pixel)

    @property
    def rows(self) -> int:
        return self.height_m.shape[0]

    @property
    def cols(self) -> int:
        return self.height_m.shape[1]

    @property
    def source_name(self) -> str:
        """What a bake tells of its source: the file's name without its folders, or "sample:NAME"."""
        return self.source if self.source.startswith("sample:") else Path(self.source).name

    @property
    def stem(self) -> str:
        """The sample's name, or the file's without its ending."""
        return self.source.removeprefix("sample:") if self.source.startswith("sample:") else Path(self.source).stem

    @property
    def size_m(self) -> tuple[float, float]:
        """(Ly, Lx): the sides of the scan in metres, pixel edge to pixel edge."""
        return self.rows * self.pixel_size_m[0], self.cols * self.pixel_size_m[1]


def level_plane(hm: HeightMap) -> HeightMap:
    """Take the least-squares plane through the finite pixels out of the heights.

    The result has zero mean over its finite pixels; NaN stays NaN. Works for one row, one column and pixels
    that lie on a line, where the plane is not unique and the flattest one is taken. Of a periodic surface
    only the mean goes: it cannot be tilted and still wrap, and the slope that a fit finds in it is that of
    its facets.
    """
    if hm.periodic:
        return replace(hm, height_m=hm.height_m - np.nanmean(hm.height_m))
    offset, along_y, along_x = _plane(hm.height_m)
    level = hm.height_m - offset
    level -= along_y
    level -= along_x
    return replace(hm, height_m=level)


def fill_missing(hm: HeightMap) -> HeightMap:
    """Give every NaN a height: the fitted plane plus a nearly harmonic interpolation of what stands out.

    Measured pixels are kept to the bit, the rest carries no step at the rim of a hole and no value outside
    the measured ones (seen from the plane), so that the phasor has no edge that the surface does not have.
    """
    missing = np.isnan(hm.height_m)
    if not missing.any():
        return hm
    plane = sum(_plane(hm.height_m))
    filled = _fill(hm.height_m - plane) + plane
    return replace(hm, height_m=np.where(missing, filled, hm.height_m))


def _plane(height: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """The least-squares plane through the finite heights: its mean, and what its slopes add along y (rows, 1) and x
    (cols,).

    Sums over rows and columns instead of a design matrix, a few rows at a time: an 8192 x 8192 scan and a copy of it
    are half a gigabyte each. The coordinates are centred and scaled, so that the normal equations are about as well
    conditioned as they can be.
    """
    finite = np.isfinite(height)
    in_row, in_column = finite.sum(axis=1, dtype=float), finite.sum(axis=0, dtype=float)
    count = in_row.sum()
    y, x = (np.linspace(-1.0, 1.0, n) if n > 1 else np.zeros(1) for n in height.shape)
    y = y - in_row @ y / count
    x = x - in_column @ x / count
    offset = np.mean(height, where=finite)
    cross, moment = 0.0, np.zeros(2)
    for start in range(0, len(y), _ROWS_AT_ONCE):
        part = slice(start, start + _ROWS_AT_ONCE)
        cross += y[part] @ (finite[part] @ x)
        residual = np.where(finite[part], height[part] - offset, 0.0)
        moment += y[part] @ residual.sum(axis=1), residual.sum(axis=0) @ x
    normal = np.array([[in_row @ y**2, cross], [cross, in_column @ x**2]])
    slope_y, slope_x = np.linalg.lstsq(normal, moment, rcond=_RANK_TOLERANCE)[0]
    return offset, slope_y * y[:, None], slope_x * x


def _fill(height: np.ndarray) -> np.ndarray:
    """Fill NaN from a half-size copy filled in the same way, then relax towards the neighbours' mean."""
    missing = np.isnan(height)
    if not missing.any():
        return height
    rows, cols = height.shape
    coarse = _fill(_halve(height))
    filled = np.where(missing, np.repeat(np.repeat(coarse, 2, axis=0), 2, axis=1)[:rows, :cols], height)
    r, c = np.nonzero(missing)
    up, down = np.maximum(r - 1, 0), np.minimum(r + 1, rows - 1)
    left, right = np.maximum(c - 1, 0), np.minimum(c + 1, cols - 1)
    for _ in range(_FILL_SWEEPS):
        around = filled[up, c] + filled[down, c] + filled[r, left] + filled[r, right]
        filled[r, c] = (filled[r, c] + around) / 5
    return filled


def _halve(height: np.ndarray) -> np.ndarray:
    """Mean of the finite values in each 2 x 2 block; NaN where a block has none."""
    rows, cols = height.shape
    padded = np.pad(height, ((0, rows % 2), (0, cols % 2)), constant_values=np.nan)
    blocks = padded.reshape(padded.shape[0] // 2, 2, padded.shape[1] // 2, 2)
    count = np.isfinite(blocks).sum(axis=(1, 3))
    total = np.nansum(blocks, axis=(1, 3))
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
