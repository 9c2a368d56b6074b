# SPDX-License-Identifier: GPL-3.0-or-later
"""A matter's reflectance as curves over the half angle, for sums over many directions.

The reflectance is that of the half angle, whose cosine is |wi + wr| / 2 = sqrt(u^2 + v^2 + w^2) / 2. So it is a
function of the wavelength and of a table's own variables.
"""

import numpy as np

from .matter import Matter

# Number of cosines that a curve is computed for, and that it is read at. Even the fringes of a layer of 10 um, 100
# along a curve, have 20 computed cosines each.
_COMPUTED, _READ = 2049, 16385


def reflectance_curves(matter: Matter, wavelengths_m: np.ndarray) -> np.ndarray | None:
    """The reflectance (n, cosines) float32 at wavelengths (n,) in metres, at the cosines that `cosine_places` counts.

    None for a dielectric, whose reflectance is not in the table."""
    if not matter.baked:
        return None
    computed, read = np.linspace(0, 1, _COMPUTED), np.linspace(0, 1, _READ)
    curves = matter.reflectance(wavelengths_m, computed)
    return np.stack([np.interp(read, computed, curve) for curve in curves]).astype(np.float32)


def cosine_places(u: np.ndarray, v: np.ndarray, w: np.ndarray) -> np.ndarray:
    """The places (...,) in a curve of the half angles of (u, v, w), which are broadcast together."""
    return np.rint(half_angle_cosines(u, v, w) * (_READ - 1)).astype(np.uint16)


def half_angle_cosines(u: np.ndarray, v: np.ndarray, w: np.ndarray | float) -> np.ndarray:
    """The cosines (...,) of the half angle at (u, v, w) = wi + wr; 1 beyond the pairs of directions."""
    return np.minimum(np.sqrt(u**2 + v**2 + w**2) / 2, 1)
