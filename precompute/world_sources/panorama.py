# SPDX-License-Identifier: GPL-3.0-or-later
"""Cells of equirectangular pictures of a world, in Blender's convention.

Row 0 is at the bottom, as in Blender's pixels. The picture's centre looks along +X, its left half towards +Y, its top
row towards +Z. Blender's Environment Texture reads pictures this way. A panoramic camera of Cycles that looks along +X,
with +Z up, renders them this way.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Cells:
    """Pieces of the sphere, one per pixel of a picture, in pixel order: rows from the bottom.

    directions      (n, 3) unit vectors to the cells' centres
    solid_angles    (n,) steradians
    moments         (n, 3) the integral of the unit vector over each cell. The wider the cell, the shorter the moment is
                    than the solid angle, so a sum of moments includes the width of its cells"""

    directions: np.ndarray
    solid_angles: np.ndarray
    moments: np.ndarray

    def __getitem__(self, which: np.ndarray) -> "Cells":
        """Some of the cells, by their indices or a mask."""
        return Cells(self.directions[which], self.solid_angles[which], self.moments[which])


def panorama_cells(rows: int, cols: int) -> Cells:
    """The cells of a picture of the whole sphere."""
    return _cells((rows, cols), np.pi / 2, np.pi)


def crop_cells(size: int, half_angle: float, direction: np.ndarray) -> Cells:
    """The cells of a square picture, `size` pixels wide, that looks along `direction` (3,).

    Latitude and longitude about the axes of crop_frame(direction) go from -half_angle to half_angle, in radians."""
    cells = _cells((size, size), half_angle, half_angle)
    frame = crop_frame(direction)
    return Cells(cells.directions @ frame.T, cells.solid_angles, cells.moments @ frame.T)


def crop_frame(direction: np.ndarray) -> np.ndarray:
    """The axes (3, 3) of a crop. The columns are world directions: to the crop's centre, to its left, and up."""
    forward = np.asarray(direction, float) / np.linalg.norm(direction)
    beside = np.cross((0.0, 0.0, 1.0) if abs(forward[2]) < 0.9 else (0.0, 1.0, 0.0), forward)
    left = beside / np.linalg.norm(beside)
    return np.stack((forward, left, np.cross(forward, left)), axis=1)


def inside_crop(directions: np.ndarray, half_angle: float, direction: np.ndarray) -> np.ndarray:
    """Which directions (n, 3) a crop shows, as a mask (n,)."""
    x, y, z = (directions @ crop_frame(direction)).T
    return (np.abs(np.arctan2(y, x)) < half_angle) & (np.abs(np.arcsin(np.clip(z, -1, 1))) < half_angle)


def _cells(shape: tuple[int, int], latitude: float, longitude: float) -> Cells:
    """The cells of a picture from -latitude to latitude, and from longitude at its left to -longitude.

    The integrals over a cell are written as products, which stay exact for tiny cells."""
    rows, cols = shape
    high, wide = 2 * latitude / rows, 2 * longitude / cols
    theta = ((np.arange(rows) + 0.5) * high - latitude)[:, None]
    phi = (longitude - (np.arange(cols) + 0.5) * wide)[None, :]
    directions = np.stack(np.broadcast_arrays(np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), np.sin(theta)))
    solid_angles = np.broadcast_to(2 * np.cos(theta) * np.sin(high / 2) * wide, shape)
    across = high / 2 + np.cos(2 * theta) * np.sin(high) / 2  # the integral of cos^2 over the latitude
    chord = 2 * np.sin(wide / 2)
    upwards = np.sin(2 * theta) * np.sin(high) / 2 * wide
    moments = np.stack(np.broadcast_arrays(across * chord * np.cos(phi), across * chord * np.sin(phi), upwards))
    return Cells(directions.reshape(3, -1).T, solid_angles.reshape(-1), moments.reshape(3, -1).T)
