# SPDX-License-Identifier: GPL-3.0-or-later
"""What a plate lets through, with the light that it traps and gives back to its relief, as a table holds and reads it.

bake/trapped_light.py computes the gains of the scattered light and of the mirror image. Each is a square table of the
directions above the plate, which a renderer reads by cubic B-splines. It maps the hemisphere to a disc of radius 1
around the normal. A unit vector (x, y, c) is at

    (x, y) / sqrt((1 + sqrt(c)) (1 + c)),

at distance sqrt(1 - sqrt(c)) from the centre and at the vector's own azimuth. The map is smooth at the normal, which
has no azimuth. At distance r, c = (1 - r^2)^2. A function that is smooth in c is smooth across the disc's rim too, and
the texels beyond the rim hold the value for this c."""

from dataclasses import dataclass, replace

import numpy as np

from ..maths import bspline

# A reading at the rim of the disc uses texels up to two beyond the rim.
_RIM = 2


def disc_texel(count: int) -> float:
    """The step of the disc's coordinates per texel, in a table of `count` texels a side.

    Along a line through the centre, all texels but one at each end are on the disc."""
    return 2 / (count - 1 - _RIM)


def texel_directions(count: int) -> np.ndarray:
    """Unit vectors (count, count, 3) along (T, B, N) for the texels of a table.

    The table's x axis runs along T, its y axis along B. Texels over two beyond the rim are never read."""
    at = (np.arange(count) - (count - 1) / 2) * disc_texel(count)
    x, y = np.meshgrid(at, at)
    radius = np.hypot(x, y)
    # At distance sqrt(2) the cosine is 1 again.
    farthest = min(1 + (_RIM + 1) * disc_texel(count), np.sqrt(2))
    cosine = (1 - np.minimum(radius, farthest) ** 2) ** 2
    # The centre of a table with an odd count is the normal, whose sine is 0.
    along = np.sqrt(np.maximum(1 - cosine**2, 0)) / np.maximum(radius, np.finfo(float).tiny)
    return np.stack([x * along, y * along, cosine], axis=-1)


def place(directions: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Row and column (...,) of unit vectors (..., 3) in a table of `count` texels a side."""
    x, y, cosine = np.moveaxis(np.asarray(directions, float), -1, 0)
    cosine = np.clip(cosine, 1e-6, 1)
    along = 1 / (np.sqrt((1 + np.sqrt(cosine)) * (1 + cosine)) * disc_texel(count))
    middle = (count - 1) / 2
    return y * along + middle, x * along + middle


# Texels a side.
GAIN_TEXELS = 48


@dataclass(frozen=True)
class PlateGains:
    """The gains of a relief under a plate, as samples of cubic B-splines.

    scattered  (n, n), g: of the relief's scattered light from wi to wr, g(wi) g(wr) leaves the plate; T(ti) T(tr)
               without the light that is given back
    mirror     (n, n, channels), what the zero order's colour has more than T(ti) T(tr) Z towards a direction"""

    scattered: np.ndarray
    mirror: np.ndarray

    def of_scattered(self, wi: np.ndarray, wr: np.ndarray) -> np.ndarray:
        """g(wi) g(wr) (...,) for unit vectors (..., 3) above the plate."""
        return _read(self.scattered, wi) * _read(self.scattered, wr)

    def mirror_xyz(self, directions: np.ndarray) -> np.ndarray:
        """The zero order's further XYZ (..., 3) towards unit vectors (..., 3) above the plate."""
        return np.stack([_read(self.mirror[..., k], directions) for k in range(3)], axis=-1)

    def under(self, matrix: np.ndarray) -> "PlateGains":
        """The gains whose mirror's channels are a matrix (channels, 3) times these."""
        return replace(self, mirror=self.mirror @ matrix)


def _read(table: np.ndarray, directions: np.ndarray) -> np.ndarray:
    return bspline.read_grid(table, *place(directions, len(table)))
