# SPDX-License-Identifier: GPL-3.0-or-later
"""Levelling a height map: the least-squares plane taken out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .height_map import HeightMap

# Singular values below this share of the largest mean that the pixels lie on a line or a point; the plane is
# then the flattest of those that fit.
_RANK_TOLERANCE = 1e-12


_ROWS_AT_ONCE = 256


def level_plane(hm: HeightMap) -> HeightMap:
    """Take the least-squares plane through the finite pixels out of the heights.

    The result has zero mean over its finite pixels; NaN stays NaN. Works for one row, one column and pixels
    that lie on a line, where the plane is not unique and the flattest one is taken. Of a periodic surface
    only the mean goes: it cannot be tilted and still wrap, and the slope that a fit finds in it is that of
    its facets.
    """
    if hm.periodic:
        return replace(hm, height_m=hm.height_m - np.nanmean(hm.height_m))
    offset, along_y, along_x = fitted_plane(hm.height_m)
    level = hm.height_m - offset
    level -= along_y
    level -= along_x
    return replace(hm, height_m=level)


def fitted_plane(height: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
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
