# SPDX-License-Identifier: GPL-3.0-or-later
"""Plane levelling: subtracts the least-squares plane from a height map."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .height_map import HeightMap

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
