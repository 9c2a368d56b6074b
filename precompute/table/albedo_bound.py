# SPDX-License-Identifier: GPL-3.0-or-later
"""The albedo bound, as a table holds it and as a renderer reads it.

The energy-conserving form of the BRDF divides by this bound, so that no surface reflects more than it receives. Its
derivation is in docs/theory.md, section "BRDF", "Albedo bound". The bound is max(1, a) = 1 + E / cos(t), where a is the
directional albedo, t the angle from the normal, and E the excess albedo. bake/excess_albedo.py computes the table of E.
"""

import numpy as np

from ..maths import bspline

# Size of the table of excess albedo: 64 steps of azimuth, and the first azimuth once more at the end. How well a bound
# read from it keeps the albedo under 1 is measured by `./dev bench albedo`.
BOUND_ROWS, BOUND_COLUMNS = 32, 65
# The smallest table that can be read: no direction has any excess.
NO_EXCESS = np.zeros((2, 2), np.float32)


def texel_directions(rows: int = BOUND_ROWS, columns: int = BOUND_COLUMNS) -> np.ndarray:
    """Unit vector (rows, columns, 3) in the frame (T, B, N) for each texel of a table of excess albedo.

    Rows are equal steps of sqrt(cos(t)), from the horizon to the normal. Columns are equal steps of azimuth from -pi to
    pi, both ends included."""
    cosine = np.linspace(0, 1, rows)[:, None] ** 2
    azimuth = np.linspace(-np.pi, np.pi, columns)
    sine = np.sqrt(1 - cosine**2)
    return np.stack(np.broadcast_arrays(sine * np.cos(azimuth), sine * np.sin(azimuth), cosine), axis=-1)


def albedo_bound(table: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """The bound max(1, a) (...,) for unit vectors (..., 3), read from a table (rows, columns) of excess albedo.

    The table is read as a renderer reads it: by cubic B-splines."""
    rows, columns = table.shape
    x, y, cosine = np.moveaxis(np.asarray(directions, float), -1, 0)
    column = (np.arctan2(y, x) / (2 * np.pi) + 0.5) * (columns - 1) + 1
    row = np.sqrt(np.clip(cosine, 0, 1)) * (rows - 1) + 1
    return 1 + bspline.read_grid(with_rim(table), row, column) / np.maximum(cosine, 1e-6)


def with_rim(table: np.ndarray) -> np.ndarray:
    """A table (rows, columns) with one more texel on every side, which cubic reading at the rim needs; (rows + 2,
    columns + 2).

    Rows are mirrored at both ends. Columns wrap around: the first and the last column are the same azimuth, so the
    column before the first is a copy of the last but one, and the column after the last a copy of the second."""
    return np.pad(np.concatenate([table[:, -2:-1], table, table[:, 1:2]], axis=1), ((1, 1), (0, 0)), mode="reflect")
