# SPDX-License-Identifier: GPL-3.0-or-later
"""Levelling: the least-squares plane is subtracted from a height map."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .height_map import HeightMap

# A singular value below this share of the largest one means that the pixels lie on a line or a point. Many planes fit
# such pixels; the flattest of them is taken.
_RANK_TOLERANCE = 1e-12
_ROWS_AT_ONCE = 256


@dataclass(frozen=True)
class Plane:
    """The plane that levelling subtracts from a height map, as three terms in metres.

    offset   the mean of the finite heights
    along_y  the slope's part along the rows (rows, 1)
    along_x  the slope's part along the columns (cols,)"""

    offset: float
    along_y: np.ndarray
    along_x: np.ndarray

    def level_part(self, height_map: HeightMap, part: tuple[slice, slice]) -> np.ndarray:
        """The levelled heights of a part of the map, rows and columns."""
        level = height_map.height_m[part] - self.offset
        level -= self.along_y[part[0]]
        level -= self.along_x[part[1]]
        return level


def plane_of(height_map: HeightMap) -> Plane:
    """The plane that level_plane subtracts."""
    if height_map.periodic:
        rows, cols = height_map.height_m.shape
        return Plane(float(np.nanmean(height_map.height_m)), np.zeros((rows, 1)), np.zeros(cols))
    return Plane(*fitted_plane(height_map.height_m))


def level_plane(height_map: HeightMap) -> HeightMap:
    """Subtract the least-squares plane through the finite heights.

    The mean of the result's finite heights is zero; NaN stays NaN. Where all pixels lie on a line (a single row, for
    example) many planes fit, and the flattest is subtracted. From a periodic surface only the mean is subtracted: a
    tilted surface would not wrap, so the slope that a fit would find is that of the surface's facets.
    """
    whole = slice(None), slice(None)
    return replace(height_map, height_m=plane_of(height_map).level_part(height_map, whole))


def fitted_plane(height: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """The least-squares plane through the finite heights of an array (rows, cols).

    Returns three terms whose sum is the plane: the mean of the finite heights, the slope's part along the rows
    (rows, 1) and the slope's part along the columns (cols,), all in the heights' unit.

    The normal equations are summed over a few rows at a time. A design matrix would take too much memory: a scan of
    8192 x 8192 pixels alone is half a gigabyte. The coordinates are centred and scaled to keep the equations well
    conditioned.
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
