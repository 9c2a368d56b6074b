# SPDX-License-Identifier: GPL-3.0-or-later
"""Fresnel reflectance of a smooth surface: dielectric, conductor, and Schlick's approximation."""

import numpy as np

KERATIN_IOR = 1.56
THESIS_IOR = 1.5


def fresnel_reflectance(cosine: np.ndarray, ior: float = KERATIN_IOR) -> np.ndarray:
    """The power reflectance (...,) of a smooth dielectric, mean of both polarisations (Born and Wolf 1.5.2).

    cosine (...,) is the cosine of the angle of incidence; ior is the refractive index relative to air."""
    c = np.clip(cosine, 0, 1)
    g = np.sqrt(ior**2 - 1 + c**2)
    perpendicular = ((c - g) / (c + g)) ** 2
    parallel = ((ior**2 * c - g) / (ior**2 * c + g)) ** 2
    return 0.5 * (perpendicular + parallel)


def fresnel_conductor(cosine: np.ndarray, n: float, k: float) -> np.ndarray:
    """The power reflectance (...,) of a smooth conductor, mean of both polarisations (Born and Wolf 14.2).

    cosine (...,) is the cosine of the angle of incidence; the refractive index is n - ik or n + ik. With k = 0 it is
    the reflectance of a dielectric."""
    c = np.clip(cosine, 0, 1)
    sine2 = 1 - c**2
    root = np.sqrt((n + 1j * k) ** 2 - sine2)
    perpendicular = np.abs((c - root) / (c + root)) ** 2
    tangent = sine2 / np.maximum(c, 1e-12)
    parallel = perpendicular * np.abs((root - tangent) / (root + tangent)) ** 2
    return 0.5 * (perpendicular + parallel)


def fresnel_schlick(cosine: np.ndarray, ior: float = THESIS_IOR) -> np.ndarray:
    """Schlick's approximation (...,): F0 + (1 - F0) (1 - cosine)^5, F0 = ((ior - 1) / (ior + 1))^2 (Schlick 1994)."""
    normal = ((ior - 1) / (ior + 1)) ** 2
    return normal + (1 - normal) * (1 - np.clip(cosine, 0, 1)) ** 5
