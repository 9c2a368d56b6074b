# SPDX-License-Identifier: GPL-3.0-or-later
"""A matter's reflectance as curves over the half angle, for sums over many directions.

The reflectance is that of the half angle, whose cosine is |wi + wr| / 2 = sqrt(u^2 + v^2 + w^2) / 2. So it is a
function of the wavelength and of a table's own variables. Under a plate they are those of the directions inside.
"""

from collections.abc import Callable

import numpy as np

from .matter import Matter

# Number of cosines that a curve is computed for, and that it is read at. Even the fringes of a layer of 10 um, 100
# along a curve, have 20 computed cosines each.
_COMPUTED, _READ = 2049, 16385


def reflectance_at(
    matter: Matter, wavelengths_m: np.ndarray, places: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> Callable[[int], np.ndarray | float]:
    """Return a function of k: the reflectance (...,) float32 at the k-th of wavelengths_m (n,) in metres, at the half
    angles of places (u, v, w), which are broadcast together.

    It is 1 for a dielectric, whose reflectance is not in the table, and then nothing is computed."""
    if not matter.baked:
        return lambda k: 1.0
    computed, read = np.linspace(0, 1, _COMPUTED), np.linspace(0, 1, _READ)
    curves = matter.reflectance(wavelengths_m, computed)
    curves = np.stack([np.interp(read, computed, curve) for curve in curves]).astype(np.float32)
    index = np.rint(half_angle_cosines(*places) * (_READ - 1)).astype(np.uint16)
    return lambda k: curves[k][index]


def half_angle_cosines(u: np.ndarray, v: np.ndarray, w: np.ndarray | float) -> np.ndarray:
    """The cosines (...,) of the half angle at (u, v, w) = wi + wr; 1 beyond the pairs of directions."""
    return np.minimum(np.sqrt(u**2 + v**2 + w**2) / 2, 1)
