# SPDX-License-Identifier: GPL-3.0-or-later
"""Worlds as panoramas: radiance (rows, 2 rows, 3), laid out as precompute/world_sources/sources.py says. See also
room.py."""

import numpy as np

from precompute.world_sources.sources import panorama_cells

# Direction, width and height in degrees, and radiance of each soft box.
BOXES = (
    ((0.6, -0.5, 0.75), 30, 20, (10.0, 10.0, 10.0)),
    ((-0.8, -0.3, 0.6), 16, 16, (5.0, 5.2, 5.6)),
    ((-0.1, 0.9, 0.5), 6, 40, (12.0, 11.4, 10.4)),
)


def overcast(rows: int) -> np.ndarray:
    """The CIE overcast sky over dark ground."""
    height = panorama_cells(rows, 2 * rows).directions[:, 2]
    edge = np.clip(height * rows / np.pi + 0.5, 0, 1)
    grey = 0.3 * (edge * (1 + 2 * np.maximum(height, 0)) / 3 + (1 - edge) * 0.1)
    return np.repeat(grey.reshape(rows, 2 * rows, 1), 3, axis=2)


def soft_boxes(rows: int) -> np.ndarray:
    """A studio: key, fill and strip light on a dim gradient."""
    directions = panorama_cells(rows, 2 * rows).directions
    grey = 0.06 * (1.2 + directions[:, 2])
    colour = np.repeat(grey[:, None], 3, axis=1)
    for towards, wide_deg, high_deg, shine in BOXES:
        forward = np.array(towards) / np.linalg.norm(towards)
        left = np.cross((0, 0, 1), forward)
        left /= np.linalg.norm(left)
        z = directions @ forward
        inside = np.where(z > 0, 1.0, 0.0)
        for axis, degrees in ((left, wide_deg), (np.cross(forward, left), high_deg)):
            off = np.abs(np.arctan2(directions @ axis, np.maximum(z, 1e-9)))
            inside = inside * np.clip((np.radians(degrees / 2) - off) * rows / np.pi + 0.5, 0, 1)
        colour += inside[:, None] * np.array(shine)
    return colour.reshape(rows, 2 * rows, 3)
