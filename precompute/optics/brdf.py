# SPDX-License-Identifier: GPL-3.0-or-later
"""Factors of the BRDF that do not depend on the relief (docs/theory.md, BRDF).

wi is the unit direction to the light, wr to the viewer, both away from the surface. ti and tr are their angles from the
normal, and w = cos(ti) + cos(tr).
"""

import numpy as np

from .fresnel import KERATIN_IOR, fresnel_reflectance
from .small_slope import small_slope_times_cosine_and_w2

# The index of refraction of the ratio form. Below 60 degrees, indices from 1.5 to 3 are equally close to Maxwell's
# equations. Beyond, 3 is better on aluminium and 1.5 on layers, and 1.5 has less albedo above 1 (docs/theory.md).
RATIO_IOR = 1.5


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Compute scalar products (...,) of vectors (..., 3)."""
    return np.einsum("...i,...i->...", a, b)


def half_angle_cosine(wi: np.ndarray, wr: np.ndarray) -> np.ndarray:
    """Compute the cosine (...,) of the half angle: between wi (..., 3) and the half vector of wi and wr (..., 3)."""
    return np.sqrt(np.clip(0.5 * (1 + dot(wi, wr)), 0, 1))


def obliquity_times_cosine_and_w2(wi: np.ndarray, wr: np.ndarray) -> np.ndarray:
    """O(wi, wr) cos(ti) w^2 = (1 + wi.wr)^2 / cos(tr) (...,) for unit directions (..., 3) (Stam 1999, equation 5).

    Stam's obliquity O has w^2 in its denominator, and the scattered spectrum vanishes as w^2. So the bake stores the
    spectrum divided by w^2, and this function returns O cos(ti) multiplied by w^2. Neither divides by a small number,
    except at a grazing view, where cos(tr) is clamped to 1e-6."""
    return (1 + dot(wi, wr)) ** 2 / np.maximum(wr[..., 2], 1e-6)


def scattering_factor(
    wi: np.ndarray, wr: np.ndarray, ior: float | np.ndarray | None = KERATIN_IOR, *, stam: bool = False
) -> np.ndarray:
    """What turns a bake's scattered XYZ over w^2 into radiance under unit irradiance (...,), for unit directions.

    A dielectric has the small slope approximation (small_slope.py), or with `stam` Stam's form: Fresnel's reflectance
    at the half angle times the obliquity. `ior` is None for a table that holds its matter's reflectance. The factor is
    then either form at RATIO_IOR over Fresnel's reflectance there, so Stam's obliquity alone or the ratio form."""
    if stam:
        reflectance = 1.0 if ior is None else fresnel_reflectance(half_angle_cosine(wi, wr), ior)
        return reflectance * obliquity_times_cosine_and_w2(wi, wr)
    if ior is None:
        reflectance = fresnel_reflectance(half_angle_cosine(wi, wr), RATIO_IOR)
        return small_slope_times_cosine_and_w2(wi, wr, RATIO_IOR) / reflectance
    return small_slope_times_cosine_and_w2(wi, wr, ior)
