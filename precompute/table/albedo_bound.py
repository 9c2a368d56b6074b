# SPDX-License-Identifier: GPL-3.0-or-later
"""The albedo bound, as a table stores it and a renderer reads it.

The energy-conserving form of the BRDF divides by this bound, so that no surface reflects more than it receives (derived
in docs/theory.md, "BRDF", "Albedo bound"). The bound is max(1, a) = 1 + E / cos(t), where a is the directional albedo,
t the angle from the normal, and E the excess albedo. bake/excess_albedo.py computes the table of E over a disc of
directions (direction_disc.py).
"""

import numpy as np

from ..maths import bspline
from .direction_disc import place

# The sizes of a bake's table in texels a side, ascending. The first is even, so that quarter turns swap its corners.
BOUND_TEXELS = (48, 96, 192)
# The smallest table that can be read.
BOUND_TEXELS_MIN = 4


def albedo_bound(table: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """The bound max(1, a) (...,) for unit vectors (..., 3), read from a table (count, count) of excess albedo.

    The table is read by cubic B-splines, as in a renderer."""
    excess = bspline.read_grid(table, *place(directions, len(table)))
    return 1 + np.maximum(excess, 0) / np.clip(np.asarray(directions, float)[..., 2], 1e-6, 1)
