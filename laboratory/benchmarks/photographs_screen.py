# SPDX-License-Identifier: GPL-3.0-or-later
"""The picture that a baked skin throws on a screen under a narrow white beam, in NumPy, by the bake's own formula.

A Diffraction Lamp's shader has the same formula; tests/render/test_diffraction_lamp.py compares the two.
"""

from dataclasses import dataclass

import numpy as np

from precompute.colour.spaces import rgb_from_xyz, shown_rgb
from precompute.table.radiance import reflected_xyz
from precompute.table.table import Table

# Pixels that are evaluated at once.
_PIXELS = 16384


@dataclass(frozen=True)
class Laboratory:
    """The experiment. The screen stands across the reflected beam, and the orders lie between beam and normal.

    along_b       whether the plane of incidence holds the scan's B axis; else it holds T
    reversed      whether the skin lies the other way round, turned by half a turn
    angle_deg     of incidence
    distance_mm   from the skin to the screen, along the reflected beam
    turn_deg      by which the screen is turned about the beam's spot, its far orders away from the skin
    """

    along_b: bool = False
    reversed: bool = False
    angle_deg: float = 45.0
    distance_mm: float = 60.0
    turn_deg: float = 0.0


def picture(
    table: Table, laboratory: Laboratory, shape: tuple[int, int], *, beam: tuple[float, float], mm_per_pixel: float
) -> np.ndarray:
    """Linear Rec.709 light (rows, columns, 3) on the screen, without a scale, the first order to the right.

    `shape` is the picture's rows and columns, `beam` the row and column of the reflected beam. The patch is a point,
    and negative components are clipped, as a camera does."""
    sine, cosine = np.sin(np.radians(laboratory.angle_deg)), np.cos(np.radians(laboratory.angle_deg))
    turn = np.radians(laboratory.turn_deg)
    # In the frame of the plane of incidence: the orders' side, across, the normal.
    reflected = np.array([-sine, 0, cosine])
    right = np.cos(turn) * np.array([cosine, 0, sine]) + np.sin(turn) * reflected
    up = np.array([0.0, 1, 0])
    rows, columns = np.indices(shape).reshape(2, -1)
    across = (columns - beam[1])[:, None] * right - (rows - beam[0])[:, None] * up
    places = laboratory.distance_mm * reflected + mm_per_pixel * across
    distance = np.linalg.norm(places, axis=-1, keepdims=True)
    wr = places / distance
    wi = np.array([sine, 0, cosine])
    to_skin = _frame(laboratory)
    light = np.zeros((len(wr), 3))
    seen = np.flatnonzero(wr[:, 2] > 0)
    for start in range(0, len(seen), _PIXELS):
        part = seen[start : start + _PIXELS]
        light[part] = reflected_xyz(table, wi @ to_skin, wr[part] @ to_skin, variance=table.kernel_variance)
    # A patch sends its radiance times its cosine, and the screen has a cosine of its own.
    falls = wr[:, 2] * np.abs(wr @ np.cross(right, up)) / distance[:, 0] ** 2
    return (shown_rgb(light, rgb_from_xyz()) * falls[:, None]).reshape(*shape, 3)


def _frame(laboratory: Laboratory) -> np.ndarray:
    """The matrix (3, 3) that turns a row vector of the plane of incidence's frame into one along (T, B, N)."""
    side = -1.0 if laboratory.reversed else 1.0
    if laboratory.along_b:
        return np.array([[0, side, 0], [-side, 0, 0], [0, 0, 1.0]])
    return np.diag([side, side, 1.0])
