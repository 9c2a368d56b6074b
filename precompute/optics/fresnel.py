# SPDX-License-Identifier: GPL-3.0-or-later
"""Fresnel reflectance of a smooth dielectric."""

import numpy as np

KERATIN_IOR = 1.56


def fresnel_reflectance(cosine: np.ndarray, ior: float | np.ndarray = KERATIN_IOR) -> np.ndarray:
    """The power reflectance (...,) of a smooth dielectric for unpolarised light (Born and Wolf 1.5.2).

    cosine (...,) is the cosine of the angle of incidence; ior is the refractive index relative to air."""
    c = np.clip(cosine, 0, 1)
    g = np.sqrt(ior**2 - 1 + c**2)
    perpendicular = ((c - g) / (c + g)) ** 2
    parallel = ((ior**2 * c - g) / (ior**2 * c + g)) ** 2
    return 0.5 * (perpendicular + parallel)
