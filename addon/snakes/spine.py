# SPDX-License-Identifier: GPL-3.0-or-later
"""The line that a snake's belly rests on, from a pose or from any polygon, with a frame that belly and back follow."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...precompute.base.failure import GratingError

# Rows of the table of a spine: a step is a 25th of the body's radius, so that no bend is a polygon.
_STATIONS = 2001
# A polygon is resampled to so many control points at most: more of them would pass its corners on to the body.
_CONTROLS = 96


class Spine(NamedTuple):
    """The line under the belly at `n` arc lengths s (m) from the snout: points (n, 3) in metres, and unit vectors
    (n, 3) towards the tail, to the side, and to the back. (tail, side, back) is right-handed."""

    s: np.ndarray
    points: np.ndarray
    tail: np.ndarray
    side: np.ndarray
    back: np.ndarray

    @property
    def length(self) -> float:
        """Metres from snout to tail."""
        return float(self.s[-1])


def bspline(points: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Uniform cubic B-spline of `points` (n, d) from the first to the last of them, at t (m,) in [0, 1]."""
    padded = np.vstack([2 * points[0] - points[1], points, 2 * points[-1] - points[-2]])
    x = t * (len(points) - 1)
    span = np.minimum(x.astype(int), len(points) - 2)
    x = (x - span)[:, None]
    weights = ((1 - x) ** 3, 3 * x**3 - 6 * x**2 + 4, -3 * x**3 + 3 * x**2 + 3 * x + 1, x**3)
    return sum(w * padded[span + k] for k, w in enumerate(weights)) / 6


def spine_along(polygon: np.ndarray, length: float | None = None) -> Spine:
    """The spine along a polygon (n, 3) from snout to tail, scaled to a length in metres, or as long as it is.

    Raises GratingError for a polygon of fewer than two different points."""
    polygon = np.asarray(polygon, float)
    kept = np.ones(len(polygon), bool)
    kept[1:] = np.linalg.norm(np.diff(polygon, axis=0), axis=1) > 0
    polygon = polygon[kept]
    if len(polygon) < 2:
        raise GratingError("snake", "its line has no length", "give a curve of two or more different points")
    polygon = _resampled(polygon, max(4, min(_CONTROLS, len(polygon))))
    fine = bspline(polygon, np.linspace(0, 1, 10 * _STATIONS))
    arc = _arc_lengths(fine)
    s = np.linspace(0, arc[-1], _STATIONS)
    points = np.stack([np.interp(s, arc, fine[:, k]) for k in range(3)], axis=1)
    if length is not None:
        s, points = s * (length / arc[-1]), points * (length / arc[-1])
    tail = _unit(np.gradient(points, s, axis=0))
    side = _sides(tail)
    return Spine(s, points, tail, side, np.cross(tail, side))


def _resampled(polygon: np.ndarray, count: int) -> np.ndarray:
    """A polygon of `count` points at even arc lengths, or the polygon itself where it has as many."""
    if len(polygon) == count:
        return polygon
    arc = _arc_lengths(polygon)
    at = np.linspace(0, arc[-1], count)
    return np.stack([np.interp(at, arc, polygon[:, k]) for k in range(3)], axis=1)


def _arc_lengths(points: np.ndarray) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _sides(tail: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3) to the side of a body whose belly points down wherever the body lies.

    From the tail on, each is the one before, moved without twist, and drawn to the horizontal: the less, the steeper
    the body. So a neck that rises and leans back over keeps its belly in front."""
    level = np.stack([-tail[:, 1], tail[:, 0], np.zeros(len(tail))], axis=1)
    sides = np.empty_like(tail)
    side = level[-1] if level[-1].any() else np.array((0.0, 1.0, 0.0))
    for k in range(len(tail) - 1, -1, -1):
        flat = level[k] @ level[k]
        side = side + 0.2 * flat * np.copysign(1.0, level[k] @ side) * level[k]
        side = side - (side @ tail[k]) * tail[k]
        side = sides[k] = side / np.sqrt(side @ side)
    return sides
