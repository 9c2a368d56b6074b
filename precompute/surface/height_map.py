# SPDX-License-Identifier: GPL-3.0-or-later
"""Height maps: measured or synthetic heights over a rectangle, their levelling by a plane, and the filling of holes.

Heights between pixels are read by cubic convolution (Keys, IEEE Transactions on Acoustics, Speech, and Signal
Processing 29, 1981), which is exact for quadratic surfaces."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..base.failure import GratingError
from ..base.files import short_stem

# "sample:NAME" and "grating:KIND?PARAMETERS" name synthetic surfaces wherever a file can be named.
SAMPLE_PREFIX = "sample:"
GRATING_PREFIX = "grating:"


def is_synthetic(source: str) -> bool:
    """Whether a source names a synthetic surface, which needs no file: a sample, or a grating by its parameters."""
    return source.startswith((SAMPLE_PREFIX, GRATING_PREFIX))


@dataclass(frozen=True, eq=False)
class HeightMap:
    """Heights over a rectangle.

    height_m        (rows, cols) float64 in metres, positive outward, NaN where not measured; read-only. The scan's x
                    axis, left to right, runs along the tangent T; row 0 is the top, so the row index runs along -B
    pixel_size_m    (dy, dx) in metres
    source          a path, "sample:NAME" or "grating:KIND?PARAMETERS"
    channel         the channel's label; "" if the format has no channels
    channels        labels of all channels of the source
    periodic        whether the edges wrap exactly, as on synthetic surfaces
    stored_width_m  the width in the file if the user's width replaces it, NaN if the file stores none; else None

    Raises GratingError unless the heights are a two-dimensional array with a finite value and without infinite ones,
    and the pixel sizes are positive and finite.

    >>> x = np.arange(512) * 50e-9
    >>> waves = HeightMap(np.tile(75e-9 * np.sin(2 * np.pi * x / 1e-6), (512, 1)), (50e-9, 50e-9), "waves")
    >>> waves.rows, waves.cols, waves.stem
    (512, 512, 'waves')"""

    height_m: np.ndarray
    pixel_size_m: tuple[float, float]
    source: str
    channel: str = ""
    channels: tuple[str, ...] = ()
    periodic: bool = False
    stored_width_m: float | None = None

    def __post_init__(self) -> None:
        height = np.asarray(self.height_m, dtype=np.float64).view()
        if height.ndim != 2 or height.size == 0:
            raise GratingError(self.source, f"heights of shape {height.shape} are not a map", "give rows by columns")
        pixel = tuple(float(side) for side in self.pixel_size_m)
        if len(pixel) != 2 or not all(math.isfinite(side) and side > 0 for side in pixel):
            raise GratingError(self.source, f"pixel size {pixel} m is not positive", "give the real size of the scan")
        if np.isinf(height).any():
            raise GratingError(self.source, "some heights are infinite", "mark them as missing (NaN)")
        if np.isnan(height).all():
            raise GratingError(self.source, "every height is missing", "choose another channel or scan")
        height.flags.writeable = False
        object.__setattr__(self, "height_m", height)
        object.__setattr__(self, "pixel_size_m", pixel)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return self.height_m.shape[0]

    @property
    def cols(self) -> int:
        """Number of columns."""
        return self.height_m.shape[1]

    @property
    def source_name(self) -> str:
        """The file's name without folders, or a synthetic surface's whole source; a bake records it."""
        return self.source if is_synthetic(self.source) else Path(self.source).name

    @property
    def stem(self) -> str:
        """The file's name without folders and extension, or a synthetic surface's name as a file name, shortened if it
        is very long."""
        if self.source.startswith(GRATING_PREFIX):
            # Windows allows none of these three characters in a file name.
            return short_stem(self.source.translate(str.maketrans(":?&", "___")))
        is_sample = self.source.startswith(SAMPLE_PREFIX)
        return self.source.removeprefix(SAMPLE_PREFIX) if is_sample else short_stem(Path(self.source).stem)

    @property
    def size_m(self) -> tuple[float, float]:
        """(Ly, Lx): the scan's sides in metres, from outer edge to outer edge."""
        return self.rows * self.pixel_size_m[0], self.cols * self.pixel_size_m[1]


# A singular value below this share of the largest means pixels on a line or a point: the flattest plane is taken.
_RANK_TOLERANCE = 1e-12
_ROWS_AT_ONCE = 256


@dataclass(frozen=True)
class Plane:
    """The plane that levelling subtracts, as three terms in metres.

    offset   mean of the finite heights
    along_y  the slope from top to bottom (rows, 1)
    along_x  the slope from left to right (cols,)"""

    offset: float
    along_y: np.ndarray
    along_x: np.ndarray

    def level_part(self, height_map: HeightMap, part: tuple[slice, slice]) -> np.ndarray:
        """Return the levelled heights of a part of the map."""
        level = height_map.height_m[part] - self.offset
        level -= self.along_y[part[0]]
        level -= self.along_x[part[1]]
        return level


def plane_of(height_map: HeightMap) -> Plane:
    """Fit the plane that level_plane subtracts."""
    if height_map.periodic:
        rows, cols = height_map.height_m.shape
        return Plane(float(np.nanmean(height_map.height_m)), np.zeros((rows, 1)), np.zeros(cols))
    return Plane(*fitted_plane(height_map.height_m))


def level_plane(height_map: HeightMap) -> HeightMap:
    """Subtract the least-squares plane through the finite heights.

    The result's finite heights have the mean zero; NaN stays NaN. If all pixels lie on a line (a single row, say), the
    flattest plane through them is subtracted. A periodic surface loses only its mean: it has no tilt, since its edges
    wrap, and a fit would find the slope of its facets."""
    whole = slice(None), slice(None)
    return replace(height_map, height_m=plane_of(height_map).level_part(height_map, whole))


def fitted_plane(height: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Fit the least-squares plane through the finite heights of an array (rows, cols).

    Returns the three terms of Plane, in the heights' unit. The normal equations are summed over a few rows at a time,
    since a design matrix would take several times the scan's memory. Coordinates are centred and scaled to keep the
    equations well conditioned."""
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


# Relaxation sweeps at each resolution: enough to smooth the steps of the fill at half the resolution.
_FILL_SWEEPS = 8


def fill_missing(height_map: HeightMap) -> HeightMap:
    """Replace every NaN by the fitted plane plus a nearly harmonic interpolation of the residual.

    Measured heights stay bit-identical. A filled hole has no step at its rim, and its heights above the plane stay
    within the range of the measured ones, so the phasor gets no false edge."""
    missing = np.isnan(height_map.height_m)
    if not missing.any():
        return height_map
    plane = sum(fitted_plane(height_map.height_m))
    filled = _fill(height_map.height_m - plane) + plane
    return replace(height_map, height_m=np.where(missing, filled, height_map.height_m))


def _fill(height: np.ndarray) -> np.ndarray:
    """Fill NaN from a copy of half the size, filled in the same way, then relax towards the neighbours' mean."""
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
    """Average the finite values of each 2 x 2 block; NaN if all four are NaN."""
    rows, cols = height.shape
    padded = np.pad(height, ((0, rows % 2), (0, cols % 2)), constant_values=np.nan)
    blocks = padded.reshape(padded.shape[0] // 2, 2, padded.shape[1] // 2, 2)
    count = np.isfinite(blocks).sum(axis=(1, 3))
    total = np.nansum(blocks, axis=(1, 3))
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def read_between(image: np.ndarray, row: np.ndarray, col: np.ndarray) -> np.ndarray:
    """The image (rows, columns) at places that count in its pixels, from 4 x 4 pixels around each. `row` and `col`
    broadcast. Pixels at the edge repeat outward. The weights have the image's kind of float."""
    (rows, of_row), (cols, of_col) = _taps(row, image.shape[0], image.dtype), _taps(col, image.shape[1], image.dtype)
    return sum(of_row[i] * sum(of_col[j] * image[rows[i], cols[j]] for j in range(4)) for i in range(4))


def _taps(place: np.ndarray, count: int, precision: np.dtype) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """The four pixels around each place, and their weights."""
    below = np.floor(place).astype(np.int32)
    f = (place - below).astype(precision)
    weights = [
        f * (-0.5 + f * (1 - 0.5 * f)),
        1 + f * f * (-2.5 + 1.5 * f),
        f * (0.5 + f * (2 - 1.5 * f)),
        f * f * (-0.5 + 0.5 * f),
    ]
    return [np.clip(below + k, 0, count - 1) for k in (-1, 0, 1, 2)], weights
