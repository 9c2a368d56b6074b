# SPDX-License-Identifier: GPL-3.0-or-later
"""The albedo bound, as a table stores it and a renderer reads it.

The energy-conserving form of the BRDF divides by this bound, so that no surface reflects more than it receives (derived
in docs/theory.md, "BRDF", "Albedo bound"). The bound is max(1, a) = 1 + E / cos(t), where a is the directional albedo,
t the angle from the normal, and E the excess albedo. bake/excess_albedo.py computes the table of E.

The table maps the hemisphere to a disc of radius 1 around the normal. A unit vector (x, y, c) is at

    (x, y) / sqrt((1 + sqrt(c)) (1 + c)),

at distance sqrt(1 - sqrt(c)) from the centre and at the vector's own azimuth. The map is smooth at the normal, which
has no azimuth. At distance r, c = (1 - r^2)^2. E is smooth in c, so it is smooth across the disc's rim too, and the
texels beyond the rim hold the value for this c.
"""

import numpy as np

from ..maths import bspline

# The sizes of a bake's table in texels a side, ascending. The first is even, so that quarter turns swap its corners.
BOUND_TEXELS = (48, 96, 192)
# A reading at the rim of the disc uses texels up to two beyond the rim.
_RIM = 2
# The smallest table that can be read.
BOUND_TEXELS_MIN = 4


def bound_texel(count: int) -> float:
    """The step of the disc's coordinates per texel, in a table of `count` texels a side.

    Along a line through the centre, all texels but one at each end are on the disc."""
    return 2 / (count - 1 - _RIM)


def texel_directions(count: int) -> np.ndarray:
    """Unit vectors (count, count, 3) along (T, B, N) for the texels of a table of excess albedo.

    The table's x axis runs along T, its y axis along B. Texels over two beyond the rim are never read."""
    at = (np.arange(count) - (count - 1) / 2) * bound_texel(count)
    x, y = np.meshgrid(at, at)
    radius = np.hypot(x, y)
    # At distance sqrt(2) the cosine is 1 again.
    farthest = min(1 + (_RIM + 1) * bound_texel(count), np.sqrt(2))
    cosine = (1 - np.minimum(radius, farthest) ** 2) ** 2
    # The centre of a table with an odd count is the normal, whose sine is 0.
    along = np.sqrt(np.maximum(1 - cosine**2, 0)) / np.maximum(radius, np.finfo(float).tiny)
    return np.stack([x * along, y * along, cosine], axis=-1)


def place(directions: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Row and column (...,) of unit vectors (..., 3) in a table of `count` texels a side."""
    x, y, cosine = np.moveaxis(np.asarray(directions, float), -1, 0)
    cosine = np.clip(cosine, 1e-6, 1)
    along = 1 / (np.sqrt((1 + np.sqrt(cosine)) * (1 + cosine)) * bound_texel(count))
    middle = (count - 1) / 2
    return y * along + middle, x * along + middle


def albedo_bound(table: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """The bound max(1, a) (...,) for unit vectors (..., 3), read from a table (count, count) of excess albedo.

    The table is read by cubic B-splines, as in a renderer."""
    excess = bspline.read_grid(table, *place(directions, len(table)))
    return 1 + np.maximum(excess, 0) / np.clip(np.asarray(directions, float)[..., 2], 1e-6, 1)
