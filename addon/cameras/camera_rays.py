# SPDX-License-Identifier: GPL-3.0-or-later
"""Rays through the pixels of a camera's picture."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import bpy
import numpy as np
from mathutils import Matrix

# Border around the boxes, as a fraction of the picture.
_AROUND = 0.01


@dataclass(frozen=True)
class Window:
    """A rectangle of a picture, in coordinates from 0 to 1 along x and y."""

    low: tuple[float, float] = (0.0, 0.0)
    high: tuple[float, float] = (1.0, 1.0)


class Pixels:
    """Converts the pixels of a camera's picture to rays into the scene."""

    def __init__(self, scene: bpy.types.Scene, camera: bpy.types.Object) -> None:
        render, place = scene.render, camera.matrix_world
        # As in renders, the camera's scale is ignored.
        self._axes = np.array(place.to_quaternion().to_matrix())
        self._origin = np.array(place.translation)
        self._kind = camera.data.type
        right_top, _, left_bottom, _ = (np.array(corner) for corner in camera.data.view_frame(scene=scene))
        self._corner, self._span = left_bottom, right_top - left_bottom
        share = render.resolution_percentage / 100
        self.size = tuple(max(1, int(side * share)) for side in (render.resolution_x, render.resolution_y))

    def rays(self, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Origins (n, 3) and unit directions (n, 3) of the rays through picture coordinates (n, 2) from 0 to 1. Every
        panorama is treated as a full equirectangular one."""
        if self._kind == "PANO":
            around, up = (0.5 - at[:, 0]) * 2 * math.pi, (at[:, 1] - 0.5) * math.pi
            own = np.stack([-np.cos(up) * np.sin(around), np.sin(up), -np.cos(up) * np.cos(around)], axis=1)
            origins = np.zeros(own.shape)
        else:
            own = self._corner + np.c_[at, np.zeros(len(at))] * self._span
            origins = np.zeros(own.shape)
            if self._kind == "ORTHO":
                origins, own = own * (1.0, 1.0, 0.0), np.broadcast_to((0.0, 0.0, -1.0), own.shape)
        directions = own @ self._axes.T
        return origins @ self._axes.T + self._origin, directions / np.linalg.norm(directions, axis=1, keepdims=True)

    @property
    def up(self) -> np.ndarray:
        """The unit vector (3,) that points up in the picture."""
        return self._axes[:, 1]

    @property
    def right(self) -> np.ndarray:
        """The unit vector (3,) that points to the right in the picture."""
        return self._axes[:, 0]

    @property
    def lens(self) -> np.ndarray | None:
        """The place (3,) of a perspective camera's lens; None for another camera."""
        return self._origin if self._kind == "PERSP" else None

    def shows(self, points: np.ndarray) -> np.ndarray:
        """Whether points (n, 3) lie in the picture, in front of the camera, (n,). A panorama shows all."""
        if self._kind == "PANO":
            return np.ones(len(points), bool)
        own = (points - self._origin) @ self._axes
        in_front = own[:, 2] < -1e-6
        if self._kind == "PERSP":
            own = own * (self._corner[2] / np.where(in_front, own[:, 2], -1.0))[:, None]
        at = (own - self._corner)[:, :2] / self._span[:2]
        return in_front & ((at >= 0) & (at <= 1)).all(axis=1)

    def places(self, window: Window, count: int) -> np.ndarray:
        """The centres of about `count` pixels on a grid in a window, (n, 2), in picture coordinates from 0 to 1. In a
        panorama they cover equal areas of the sky."""
        (x0, y0), (x1, y1) = window.low, window.high
        wide, high = (x1 - x0) * self.size[0], (y1 - y0) * self.size[1]
        columns = max(1, round(math.sqrt(count * wide / high)))
        rows = max(1, round(count / columns))
        x, y = np.meshgrid(x0 + (np.arange(columns) + 0.5) / columns * (x1 - x0), (np.arange(rows) + 0.5) / rows)
        y = np.arcsin(2 * y - 1) / math.pi + 0.5 if self._kind == "PANO" else y0 + y * (y1 - y0)
        at = np.stack([x.ravel(), y.ravel()], axis=1) * self.size
        return (np.floor(np.minimum(at, np.array(self.size) - 0.5)) + 0.5) / self.size

    def in_frame(self, points: np.ndarray) -> np.ndarray:
        """Whether points (n, 3) in world space are in the picture, (n,), covered or not."""
        own = (points - self._origin) @ self._axes
        if self._kind == "PANO":
            return np.ones(len(points), bool)
        ahead = own[:, 2] < 0
        if self._kind == "PERSP":
            own = own * (self._corner[2] / np.where(ahead, own[:, 2], -np.inf))[:, None]
        at = (own - self._corner)[:, :2] / self._span[:2]
        return ahead & ((at >= 0) & (at <= 1)).all(axis=1)

    def window_of(self, boxes: Iterable[tuple[np.ndarray, Matrix]]) -> Window | None:
        """The part of the picture that contains the given boxes, each as corners (8, 3) in object space and a matrix.
        None if none is in the picture; the whole picture for a panorama, or if a corner is behind a perspective
        camera."""
        found = []
        for corners, matrix in boxes:
            world = np.array(matrix)
            own = (corners @ world[:3, :3].T + world[:3, 3] - self._origin) @ self._axes
            if self._kind == "PANO" or (self._kind == "PERSP" and own[:, 2].max() > -1e-6):
                return Window()
            if self._kind == "PERSP":
                own = own * (self._corner[2] / own[:, 2:])
            at = (own - self._corner)[:, :2] / self._span[:2]
            low, high = np.clip((at.min(axis=0) - _AROUND, at.max(axis=0) + _AROUND), 0, 1)
            if (high > low).all():
                found.append((low, high))
        if not found:
            return None
        low, high = (np.array(ends) for ends in zip(*found, strict=True))
        return Window(tuple(low.min(axis=0)), tuple(high.max(axis=0)))
