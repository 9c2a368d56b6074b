# SPDX-License-Identifier: GPL-3.0-or-later
"""The height of the soil under a snake: mounds, heaped against what lies on the soil, and nowhere inside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import bpy
import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

from .noise import fractal_noise

CELL_M = 0.001
# The soil's mean height over the floor z = 0, on which bodies lie: they seem sunk by as much.
LEVEL_M = 0.0028
# Soil stays this much below what lies on it.
_GAP_M = 0.0002
_HEAP_M, _HEAP_WIDTH_M = 0.008, 0.006
# Below this height a body counts as touching the soil.
_CONTACT_M = 0.0025
_BURIED_M = 0.0005
_DEEPEST_M = 0.006


class Walls(NamedTuple):
    """Upright planes beyond which there is no soil: at the left, x, and at the back, y."""

    x: float = -np.inf
    y: float = np.inf


OPEN = Walls()


class Body:
    """The surface of an object, in world space."""

    def __init__(self, thing: bpy.types.Object) -> None:
        bpy.context.view_layer.update()
        points = np.empty(3 * len(thing.data.vertices), np.float32)
        thing.data.vertices.foreach_get("co", points)
        matrix = np.array(thing.matrix_world)
        points = points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
        # The triangles that renderers see: a bent quad may be cut along either diagonal.
        triangles = np.empty(3 * len(thing.data.loop_triangles), np.int32)
        thing.data.loop_triangles.foreach_get("vertices", triangles)
        self._tree = BVHTree.FromPolygons(points.tolist(), triangles.reshape(-1, 3).tolist(), all_triangles=True)
        self.low, self.high = points.min(axis=0), points.max(axis=0)

    def underside(self, place: np.ndarray) -> np.ndarray:
        """The height of the lowest surface over each place (..., 2), or inf."""
        heights = np.full(place.shape[:-1], np.inf)
        near = np.nonzero(((place >= self.low[:2]) & (place <= self.high[:2])).all(axis=-1))
        start, upwards = self.low[2] - 0.01, Vector((0, 0, 1))
        hits = (self._tree.ray_cast(Vector((x, y, start)), upwards)[0] for x, y in place[near].tolist())
        heights[near] = [np.inf if hit is None else hit.z for hit in hits]
        return heights

    def is_apart(self, points: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Whether balls (n,) do not touch the surface, from its outside. Balls whose centre is deeper inside than
        _DEEPEST_M pass, so that the search is short."""
        reach = radius[:, None]
        free = np.ones(len(points), bool)
        near = np.nonzero(((points > self.low - reach) & (points < self.high + reach)).all(axis=1))[0]
        free[near] = [
            self._is_apart(Vector(point), r) for point, r in zip(points[near].tolist(), radius[near], strict=True)
        ]
        return free

    def _is_apart(self, point: Vector, radius: float) -> bool:
        surface, normal, _, distance = self._tree.find_nearest(point, max(radius, _DEEPEST_M))
        return surface is None or (distance > radius and (point - surface).dot(normal) > 0)


@dataclass(frozen=True)
class Ground:
    """Heights of the soil, and of the lowest surface above it, at cells (y, x) of a square about the origin. The second
    is `inf` where nothing lies above. `bodies` are the surfaces that lie on the soil."""

    half_m: float
    height: np.ndarray
    underside: np.ndarray
    bodies: tuple[Body, ...]

    def cells(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The nearest cells of points (..., 2)."""
        nearest = np.rint((points + self.half_m) / CELL_M).astype(int).clip(0, len(self.height) - 1)
        return nearest[..., 1], nearest[..., 0]

    def below(self, points: np.ndarray) -> np.ndarray:
        """The soil's height below points (..., 2 or 3)."""
        return self.height[self.cells(points[..., :2])]

    def is_free(self, points: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Whether balls at points (n, 3) are outside of everything that lies on the soil, and below it."""
        below = points[:, 2] + radius <= self.underside[self.cells(points[:, :2])]
        return np.logical_and.reduce([below, *(body.is_apart(points, radius) for body in self.bodies)])


def ground_below(bodies: Sequence[bpy.types.Object], half_m: float, fade_m: float, *, walls: Walls = OPEN) -> Ground:
    """The soil within `half_m` of the origin. In the last `fade_m` it falls to below the floor."""
    axis = np.arange(-half_m, half_m + CELL_M / 2, CELL_M)
    x, y = np.meshgrid(axis, axis)
    place = np.stack([x, y], axis=-1)
    surfaces = tuple(Body(body) for body in bodies)
    underside = np.minimum.reduce([np.full(x.shape, np.inf), *(surface.underside(place) for surface in surfaces)])
    heaped = _blurred(underside < _CONTACT_M, _HEAP_WIDTH_M / CELL_M)
    mounds = 0.0016 * fractal_noise(place / 0.05, 3, seed=3) + 0.0008 * fractal_noise(place / 0.009, 2, seed=9)
    # Heaps are uneven along a body.
    height = LEVEL_M + mounds + _HEAP_M * heaped * (1 + 0.7 * fractal_noise(place / 0.018, 2, seed=5))
    edge = np.clip((half_m - np.hypot(x, y)) / fade_m, 0, 1)
    underside[underside < -_BURIED_M] = np.inf  # what is buried stays buried
    height = np.minimum(height * edge**0.5 - 0.0006 * (1 - edge), underside - _GAP_M)
    outside = (x < walls.x) | (y > walls.y)
    height[outside], underside[outside] = -_GAP_M, -np.inf
    return Ground(half_m, height, underside, surfaces)


def _blurred(mask: np.ndarray, sigma: float) -> np.ndarray:
    """A mask blurred by a Gaussian of `sigma` cells."""
    reach = np.arange(-int(3 * sigma), int(3 * sigma) + 1)
    kernel = np.exp(-((reach / sigma) ** 2) / 2)
    kernel /= kernel.sum()
    blurred = mask.astype(float)
    for axis in (0, 1):
        blurred = np.apply_along_axis(np.convolve, axis, blurred, kernel, mode="same")
    return blurred
