# SPDX-License-Identifier: GPL-3.0-or-later
"""The cells of equirectangular pictures of a world, in Blender's convention.

Row 0 is at the bottom, as Blender's pixels are. The picture's middle looks along +X, its left half towards +Y, its top
row towards +Z. So Blender's Environment Texture reads a picture, and so does a panoramic camera of Cycles take one
that looks along +X, with +Z above it.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Cells:
    """Pieces of the sphere, each a picture's pixel, in the order of the pixels: rows from the bottom.

    directions      (n, 3) unit vectors to the cells' middles
    solid_angles    (n,) steradians
    moments         (n, 3) the integral of the unit vector over each cell. It is shorter than the solid angle by what
                    the cell is wide, so that a sum of moments knows the width of its cells"""

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

    Latitude and longitude in the frame crop_frame(direction) go from -half_angle to half_angle, in radians."""
    cells = _cells((size, size), half_angle, half_angle)
    frame = crop_frame(direction)
    return Cells(cells.directions @ frame.T, cells.solid_angles, cells.moments @ frame.T)


def crop_frame(direction: np.ndarray) -> np.ndarray:
    """The frame (3, 3) of a crop. Its columns are, in the world, the direction that the crop's middle looks along, the
    direction to its left, and the direction above it."""
    forward = np.asarray(direction, float) / np.linalg.norm(direction)
    beside = np.cross((0.0, 0.0, 1.0) if abs(forward[2]) < 0.9 else (0.0, 1.0, 0.0), forward)
    left = beside / np.linalg.norm(beside)
    return np.stack((forward, left, np.cross(forward, left)), axis=1)


def inside_crop(directions: np.ndarray, half_angle: float, direction: np.ndarray) -> np.ndarray:
    """Which directions (n, 3) a crop shows, as a mask (n,)."""
    x, y, z = (directions @ crop_frame(direction)).T
    return (np.abs(np.arctan2(y, x)) < half_angle) & (np.abs(np.arcsin(np.clip(z, -1, 1))) < half_angle)


def _cells(shape: tuple[int, int], latitude: float, longitude: float) -> Cells:
    """Cells of a picture from -latitude to latitude and from longitude, at its left, to -longitude.

    The integrals over a cell are written as products, which stay exact where a cell is tiny."""
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
