# SPDX-License-Identifier: GPL-3.0-or-later
"""The line on which a snake's belly rests, from a pose or any polygon, with directions for belly and back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...precompute.base.failure import GratingError

# Samples along a spine: a step is a 25th of the body's radius, so that bends look smooth.
_STATIONS = 2001
# The largest number of control points after resampling; more would pass the polygon's corners on to the body.
_CONTROLS = 96


class Spine(NamedTuple):
    """The line under the belly, at n arc lengths s from the snout in metres: points (n, 3) in metres, and unit vectors
    (n, 3) towards the tail, to the side and to the back. (tail, side, back) is right-handed."""

    s: np.ndarray
    points: np.ndarray
    tail: np.ndarray
    side: np.ndarray
    back: np.ndarray

    @property
    def length(self) -> float:
        """The length from snout to tail, in metres."""
        return float(self.s[-1])


def bspline(points: np.ndarray, t: np.ndarray) -> np.ndarray:
    """The uniform cubic B-spline of control points (n, d), from the first to the last of them, at t (m,) in [0, 1]."""
    padded = np.vstack([2 * points[0] - points[1], points, 2 * points[-1] - points[-2]])
    x = t * (len(points) - 1)
    span = np.minimum(x.astype(int), len(points) - 2)
    x = (x - span)[:, None]
    weights = ((1 - x) ** 3, 3 * x**3 - 6 * x**2 + 4, -3 * x**3 + 3 * x**2 + 3 * x + 1, x**3)
    return sum(w * padded[span + k] for k, w in enumerate(weights)) / 6


def spine_along(polygon: np.ndarray, length: float | None = None) -> Spine:
    """The spine along a polygon (n, 3) from snout to tail, scaled to a length in metres if given. Raises GratingError
    for fewer than two different points."""
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
    tail = unit(np.gradient(points, s, axis=0))
    side = _sides(tail)
    return Spine(s, points, tail, side, np.cross(tail, side))


def _resampled(polygon: np.ndarray, count: int) -> np.ndarray:
    """The polygon resampled to `count` points at equal arc lengths, unless it has that many."""
    if len(polygon) == count:
        return polygon
    arc = _arc_lengths(polygon)
    at = np.linspace(0, arc[-1], count)
    return np.stack([np.interp(at, arc, polygon[:, k]) for k in range(3)], axis=1)


def _arc_lengths(points: np.ndarray) -> np.ndarray:
    return np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _sides(tail: np.ndarray) -> np.ndarray:
    """Sideways unit vectors (n, 3) of a body whose belly points down wherever it lies.

    Starting at the tail, each vector is the previous one moved without twist, then pulled towards the horizontal; the
    pull weakens as the body gets steeper. So the belly stays in front where a neck rises and leans back."""
    level = np.stack([-tail[:, 1], tail[:, 0], np.zeros(len(tail))], axis=1)
    sides = np.empty_like(tail)
    side = level[-1] if level[-1].any() else np.array((0.0, 1.0, 0.0))
    for k in range(len(tail) - 1, -1, -1):
        flat = level[k] @ level[k]
        side = side + 0.2 * flat * np.copysign(1.0, level[k] @ side) * level[k]
        side = side - (side @ tail[k]) * tail[k]
        side = sides[k] = side / np.sqrt(side @ side)
    return sides


def smoothstep(x: np.ndarray) -> np.ndarray:
    """A smooth step: 0 up to 0, and 1 from 1 on."""
    x = np.clip(x, 0, 1)
    return x * x * (3 - 2 * x)
