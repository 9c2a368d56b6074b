# SPDX-License-Identifier: GPL-3.0-or-later
"""Panoramas of known lights."""

import numpy as np

from precompute.world_sources.sources import crop_frame, panorama_cells

ROWS, COLS = 128, 256


def direction(elevation_deg: float, azimuth_deg: float) -> np.ndarray:
    """The unit vector at a height above the horizon and an angle from +X towards +Y, both in degrees."""
    up, around = np.radians((elevation_deg, azimuth_deg))
    return np.array((np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)))


def angles_deg(towards: np.ndarray, rows: int = ROWS, cols: int = COLS) -> np.ndarray:
    """The angle of each pixel (n,) from a direction."""
    return np.degrees(np.arccos(np.clip(panorama_cells(rows, cols).directions @ towards, -1, 1)))


def disc(towards: np.ndarray, radius_deg: float, rows: int = ROWS, cols: int = COLS) -> np.ndarray:
    """1 in a disc, 0 outside, (n,), with an edge as soft as a pixel is high."""
    return np.clip((radius_deg - angles_deg(towards, rows, cols)) * rows / 180 + 0.5, 0, 1)


def box(towards: np.ndarray, width_deg: float, height_deg: float) -> np.ndarray:
    """1 in a rectangle, 0 outside, (n,)."""
    x, y, z = (panorama_cells(ROWS, COLS).directions @ crop_frame(towards)).T
    beside, above = np.degrees(np.arctan2(y, x)), np.degrees(np.arcsin(np.clip(z, -1, 1)))
    return ((np.abs(beside) < width_deg / 2) & (np.abs(above) < height_deg / 2)).astype(float)


def sky() -> np.ndarray:
    """A sky (n,) that is brighter at its zenith, over a grey ground."""
    height = panorama_cells(ROWS, COLS).directions[:, 2]
    return np.where(height > 0, 0.3 + 0.7 * height, 0.1)


def picture(luminance: np.ndarray, rows: int = ROWS, cols: int = COLS) -> np.ndarray:
    """A panorama (rows, cols, 3) whose channels are 0.8, 1 and 1.2 times the luminance."""
    return (luminance[:, None] * (0.8, 1.0, 1.2)).reshape(rows, cols, 3)
