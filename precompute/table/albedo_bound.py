# SPDX-License-Identifier: GPL-3.0-or-later
"""The albedo bound as a table holds it and as a renderer reads it."""

import numpy as np

from ..maths import bspline

BOUND_ROWS = 32


BOUND_COLUMNS = 65


NO_EXCESS = np.zeros((2, 2), np.float32)


def texel_directions(rows: int = BOUND_ROWS, columns: int = BOUND_COLUMNS) -> np.ndarray:
    """Direction (rows, columns, 3) of each texel."""
    cosine = np.linspace(0, 1, rows)[:, None] ** 2
    azimuth = np.linspace(-np.pi, np.pi, columns)
    sine = np.sqrt(1 - cosine**2)
    return np.stack(np.broadcast_arrays(sine * np.cos(azimuth), sine * np.sin(azimuth), cosine), axis=-1)


def albedo_bound(table: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """max(1, a) (...,) towards directions (..., 3), the table (rows, columns) read as a renderer reads it."""
    rows, columns = table.shape
    x, y, cosine = np.moveaxis(np.asarray(directions, float), -1, 0)
    column = (np.arctan2(y, x) / (2 * np.pi) + 0.5) * (columns - 1) + 1
    row = np.sqrt(np.clip(cosine, 0, 1)) * (rows - 1) + 1
    return 1 + bspline.read_grid(with_rim(table), row, column) / np.maximum(cosine, 1e-6)


def with_rim(table: np.ndarray) -> np.ndarray:
    """A table with the texel around it that a cubic reading meets, (rows + 2, columns + 2): rows mirrored, columns
    going round, of which the first and the last are the same azimuth."""
    return np.pad(np.concatenate([table[:, -2:-1], table, table[:, 1:2]], axis=1), ((1, 1), (0, 0)), mode="reflect")
