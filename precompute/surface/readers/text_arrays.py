# SPDX-License-Identifier: GPL-3.0-or-later
"""Readers of bare numbers as text: a matrix of heights from the scan's top, or the points (x, y, z) of a grid."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

from .number_text import AXES, decoded, is_numbers, read_text, rows_of, with_points
from .numbers_file import Judge, Numbers, NumbersReader
from .reader import KnownFault

# The largest distance of a point from the grid, as a share of a step: rounding to six digits with 2000 columns.
_OFF_GRID = 0.1
# The least share of grid points that must be present. Some may be missing at the edges of a scan that is not square.
_LEAST_COVERED = 0.25
_SAVE = "save the heights as a matrix"


def _matrix(file: BinaryIO, judge: Judge) -> Numbers:
    values = rows_of(read_text(file))  # a text has fewer numbers than a map may have
    if _is_even(values[0, 1:]) and _is_even(values[1:, 0]):
        raise KnownFault(*AXES)
    return Numbers(values)


def _is_even(numbers: np.ndarray) -> bool:
    """Whether numbers are an axis: at least three in even steps."""
    if len(numbers) < 3 or numbers[0] == numbers[1]:
        return False
    places = (numbers - numbers[0]) / (numbers[-1] - numbers[0]) * (len(numbers) - 1)
    return bool((np.abs(places - np.arange(len(numbers))) < _OFF_GRID).all())


def _points(file: BinaryIO, judge: Judge) -> Numbers:
    """Read the points as a map: x from left to right, y from the bottom up, NaN for missing points.

    Raises KnownFault if they do not lie on a grid."""
    x, y, z = rows_of(read_text(file)).T
    col, step_x = _places(x)
    row, step_y = _places(y)
    shape = row.max() + 1, col.max() + 1
    if min(shape) < 2 or len(z) < _LEAST_COVERED * shape[0] * shape[1]:
        raise KnownFault(f"{len(z)} points do not lie on a grid", _SAVE)
    judge(shape)
    values = np.full(shape, np.nan)
    values[shape[0] - 1 - row, col] = z
    return Numbers(values, step_y / step_x)


def _places(along: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the grid index of each coordinate, and the grid's step."""
    lines = np.unique(along)
    if len(lines) < 2 or not np.isfinite(lines).all():
        raise KnownFault("the points lie on a line", _SAVE)
    gaps = np.diff(lines)
    # Coordinates that differ only by rounding are the same grid line.
    step = float(np.median(gaps[gaps > _OFF_GRID * gaps.max()]))
    places = (along - lines[0]) / step
    numbers = np.rint(places)
    if np.abs(places - numbers).max() > _OFF_GRID or numbers.max() >= len(along):
        raise KnownFault("the points do not lie on a grid", _SAVE)
    return numbers.astype(np.int64), step


def _has_three_columns(beginning: bytes) -> bool:
    lines = (line.split() for line in with_points(decoded(beginning)).splitlines() if line.strip())
    whole = list(lines)
    # The last line may be cut.
    return len(whole) > 3 and all(len(line) == 3 for line in whole[:-1])


def _begins_as_points(beginning: bytes) -> bool:
    return is_numbers(beginning) and _has_three_columns(beginning)


XYZ = NumbersReader("XYZ points", (".xyz", ".txt"), _begins_as_points, _points)
MATRIX = NumbersReader("text matrix", (".txt", ".asc", ".csv", ".dat"), is_numbers, _matrix)
