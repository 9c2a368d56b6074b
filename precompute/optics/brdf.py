# SPDX-License-Identifier: GPL-3.0-or-later
"""The factors of the BRDF that do not depend on the relief: the half angle and Stam's obliquity."""

import numpy as np

from .fresnel import THESIS_IOR, fresnel_schlick


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar products (...,) of vectors (..., 3)."""
    return np.einsum("...i,...i->...", a, b)


def half_angle_cosine(wi: np.ndarray, wr: np.ndarray) -> np.ndarray:
    """Cosine (...,) of the angle between the light direction wi (..., 3) and the half vector of wi and wr."""
    return np.sqrt(np.clip(0.5 * (1 + dot(wi, wr)), 0, 1))


def obliquity_times_cosine_and_w2(wi: np.ndarray, wr: np.ndarray) -> np.ndarray:
    """O(wi, wr) * cos(ti) * w^2 = (1 + wi.wr)^2 / cos(tr), for unit directions (..., 3) (Stam 1999, eq. 5).

    Stam's O diverges as w = cos(ti) + cos(tr) -> 0 and the scattered spectrum vanishes as w^2, so the bake and this
    factor share the w^2 between them and their product never divides by a small number."""
    return (1 + dot(wi, wr)) ** 2 / np.maximum(wr[..., 2], 1e-6)


def relative_reflectance(wi: np.ndarray, wr: np.ndarray, samples: int, ior: float = THESIS_IOR) -> np.ndarray:
    """The thesis's gain C (...,), which turns the |DFT of the phasor|^2 of `samples` pixels into brightness relative to
    that of a mirror seen along its normal:

        C = F^2 (1 + wi.wr)^2 / (F0^2 (cos ti + cos tr)^2 cos tr samples^2)

    with Schlick's F at the half angle, F0 at normal incidence. Not radiometric (F is squared though it is a power
    already, and the mirror's peak is as wide as the wavelength is long); kept for comparison."""
    ratio = fresnel_schlick(half_angle_cosine(wi, wr), ior) / fresnel_schlick(np.ones(()), ior)
    w = wi[..., 2] + wr[..., 2]
    return ratio**2 * obliquity_times_cosine_and_w2(wi, wr) / np.maximum(w, 1e-6) ** 2 / samples**2
