# SPDX-License-Identifier: GPL-3.0-or-later
"""The first-order small slope approximation of a dielectric surface (Voronovich 1994, chapter 5).

The BRDF of a relief with the power spectrum PSD is

    f = 4 cos(ti) cos(tr) Q(wi, wr; n) / w^2 * PSD((u, v) / lambda; w / lambda) / lambda^2

For shallow reliefs it is exact at all angles: Q is the first-order solution of Maxwell's equations (Rice 1951),
averaged over polarisations. In the direction of the mirror image Q is the Fresnel reflectance. Q is symmetric in wi and
wr. `./dev bench rcwa_orders` compares it with Stam's obliquity.
"""

import numpy as np

from .fresnel import KERATIN_IOR

# The largest index of refraction. Beyond it the approximation reflects more light than arrives, on the steepest
# gratings already from 2.5 on (docs/theory.md, BRDF).
IOR_MAX = 3.0
# The least product of the squared sines. Below it the azimuth between the two directions has no meaning, and no effect.
_SINES_MIN = 1e-12


def small_slope_reflectance(wi: np.ndarray, wr: np.ndarray, ior: float | np.ndarray = KERATIN_IOR) -> np.ndarray:
    """Q (...,) for unit vectors wi (..., 3) to the light and wr (..., 3) to the viewer, mean of both polarisations.

    ior is the refractive index relative to air, at least 1."""
    permittivity = np.asarray(ior, float) ** 2
    cos_i, cos_r = np.clip(wi[..., 2], 0, 1), np.clip(wr[..., 2], 0, 1)
    in_i, in_r = np.sqrt(cos_i**2 + permittivity - 1), np.sqrt(cos_r**2 + permittivity - 1)
    along = wi[..., 0] * wr[..., 0] + wi[..., 1] * wr[..., 1]
    sines = np.maximum((1 - cos_i**2) * (1 - cos_r**2), _SINES_MIN)
    cos2 = np.minimum(along**2 / sines, 1)  # of the azimuth from wi to wr
    sin2 = 1 - cos2
    te_i, te_r = (cos_i + in_i) ** 2, (cos_r + in_r) ** 2
    tm_i, tm_r = (permittivity * cos_i + in_i) ** 2, (permittivity * cos_r + in_r) ** 2
    te_te = cos2 / (te_i * te_r)
    tm_te = sin2 * in_i**2 / (tm_i * te_r)
    te_tm = sin2 * in_r**2 / (te_i * tm_r)
    tm_tm = (in_i * in_r * along + permittivity * sines) ** 2 / (sines * tm_i * tm_r)
    return (permittivity - 1) ** 2 / 2 * (te_te + tm_te + te_tm + tm_tm)


def small_slope_times_cosine_and_w2(
    wi: np.ndarray, wr: np.ndarray, ior: float | np.ndarray = KERATIN_IOR
) -> np.ndarray:
    """4 cos(ti)^2 cos(tr) Q (...,): the BRDF's factor of PSD / lambda^2, times cos(ti) w^2.

    The scattered spectrum vanishes as w^2, and a bake stores it divided by w^2. So nothing is divided by a small
    number."""
    return 4 * wi[..., 2] ** 2 * wr[..., 2] * small_slope_reflectance(wi, wr, ior)
