# SPDX-License-Identifier: GPL-3.0-or-later
"""Nearest-point search in a grid of cells."""

import numpy as np


def nearest(points: np.ndarray, places: np.ndarray) -> np.ndarray:
    """For each place (p, 3) the index (p,) of the nearest of the points (n, 3), n >= 1."""
    low, high = points.min(axis=0), points.max(axis=0)
    extent = float((high - low).max()) or 1.0
    found = np.full(len(places), -1)
    left = np.arange(len(places))
    # A cell holds about one point of a surface. A place without a point that near is searched in cells twice as large.
    size = extent / max(1.0, np.sqrt(len(points)))
    while len(left):
        index, distance = _in_grid(points - low, places[left] - low, size)
        sure = distance <= size
        found[left[sure]] = index[sure]
        left = left[~sure]
        size *= 2
    return found


def _in_grid(points: np.ndarray, places: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """The nearest point in each place's cell and its neighbours, and the distance; infinite without a point."""
    cells = np.floor(points / size).astype(np.int64)
    at = np.floor(np.clip(places / size, -2, cells.max(axis=0) + 3)).astype(np.int64)
    width = cells.max(axis=0) + 7
    key = _key(cells, width)
    order = np.argsort(key, kind="stable")
    key = key[order]
    best, least = np.full(len(places), -1), np.full(len(places), np.inf)
    for offset in np.ndindex(3, 3, 3):
        around = _key(at + np.array(offset) - 1, width)
        begin, end = np.searchsorted(key, around), np.searchsorted(key, around, side="right")
        count = end - begin
        place = np.repeat(np.arange(len(places)), count)
        number = np.arange(len(place)) - np.repeat(np.cumsum(count) - count, count)
        point = order[begin[place] + number]
        distance = np.linalg.norm(points[point] - places[place], axis=1)
        # The nearest is written last.
        by_distance = np.argsort(-distance, kind="stable")
        place, point, distance = place[by_distance], point[by_distance], distance[by_distance]
        nearer = distance < least[place]
        best[place[nearer]], least[place[nearer]] = point[nearer], distance[nearer]
    return best, least


def _key(cells: np.ndarray, width: np.ndarray) -> np.ndarray:
    """One number for each cell (n, 3), whose indices run from -3 to width - 4."""
    x, y, z = (cells + 3).T
    return (x * width[1] + y) * width[2] + z
