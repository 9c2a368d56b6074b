# SPDX-License-Identifier: GPL-3.0-or-later
"""What a plate lets through, with the light that it traps and gives back to its relief, as a table holds and reads it.

bake/trapped_light.py computes both tables over a disc of directions above the plate (direction_disc.py).
"""

from dataclasses import dataclass, replace

import numpy as np

from ..maths import bspline
from .direction_disc import place

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
