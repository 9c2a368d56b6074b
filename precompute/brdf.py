# SPDX-License-Identifier: GPL-3.0-or-later
"""The factors of the BRDF that do not depend on the relief: Fresnel reflectance and Stam's obliquity."""

import numpy as np

KERATIN_IOR = 1.56
THESIS_IOR = 1.5


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar products (...,) of vectors (..., 3)."""
    return np.einsum("...i,...i->...", a, b)


def half_angle_cosine(wi: np.ndarray, wr: np.ndarray) -> np.ndarray:
    """Cosine (...,) of the angle between the light direction wi (..., 3) and the half vector of wi and wr."""
    return np.sqrt(np.clip(0.5 * (1 + dot(wi, wr)), 0, 1))


def fresnel_reflectance(cosine: np.ndarray, ior: float = KERATIN_IOR) -> np.ndarray:
    """Power reflectance (...,) of a smooth dielectric, mean of both polarisations (Born and Wolf 1.5.2).

    cosine (...,) is that of the angle of incidence; ior is relative to air."""
    c = np.clip(cosine, 0, 1)
    g = np.sqrt(ior**2 - 1 + c**2)
    perpendicular = ((c - g) / (c + g)) ** 2
    parallel = ((ior**2 * c - g) / (ior**2 * c + g)) ** 2
    return 0.5 * (perpendicular + parallel)


def obliquity_times_cosine_and_w2(wi: np.ndarray, wr: np.ndarray) -> np.ndarray:
    """O(wi, wr) * cos(ti) * w^2 = (1 + wi.wr)^2 / cos(tr), for unit directions (..., 3) (Stam 1999, eq. 5).

    Stam's O diverges as w = cos(ti) + cos(tr) -> 0 and the scattered spectrum vanishes as w^2, so the bake and this
    factor share the w^2 between them and their product never divides by a small number."""
    return (1 + dot(wi, wr)) ** 2 / np.maximum(wr[..., 2], 1e-6)


def fresnel_conductor(cosine: np.ndarray, n: float, k: float) -> np.ndarray:
    """Power reflectance (...,) of a smooth conductor of index n - ik (or n + ik), mean of both polarisations (Born and
    Wolf 14.2); k = 0 gives the dielectric's."""
    c = np.clip(cosine, 0, 1)
    sine2 = 1 - c**2
    root = np.sqrt((n + 1j * k) ** 2 - sine2)
    perpendicular = np.abs((c - root) / (c + root)) ** 2
    tangent = sine2 / np.maximum(c, 1e-12)
    parallel = perpendicular * np.abs((root - tangent) / (root + tangent)) ** 2
    return 0.5 * (perpendicular + parallel)


def fresnel_schlick(cosine: np.ndarray, ior: float = THESIS_IOR) -> np.ndarray:
    """Schlick's approximation (...,): F0 + (1 - F0) (1 - c)^5, F0 = ((ior - 1) / (ior + 1))^2 (Schlick 1994)."""
    normal = ((ior - 1) / (ior + 1)) ** 2
    return normal + (1 - normal) * (1 - np.clip(cosine, 0, 1)) ** 5


def relative_reflectance(wi: np.ndarray, wr: np.ndarray, samples: int, ior: float = THESIS_IOR) -> np.ndarray:
    """The thesis's gain C (...,), which turns the |DFT of the phasor|^2 of `samples` pixels into brightness relative to
    that of a mirror seen along its normal:

        C = F^2 (1 + wi.wr)^2 / (F0^2 (cos ti + cos tr)^2 cos tr samples^2)

    with Schlick's F at the half angle, F0 at normal incidence. Not radiometric (F is squared though it is a power
    already, and the mirror's peak is as wide as the wavelength is long); kept for comparison."""
    ratio = fresnel_schlick(half_angle_cosine(wi, wr), ior) / fresnel_schlick(np.ones(()), ior)
    w = wi[..., 2] + wr[..., 2]
    return ratio**2 * obliquity_times_cosine_and_w2(wi, wr) / np.maximum(w, 1e-6) ** 2 / samples**2
