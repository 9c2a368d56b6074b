# SPDX-License-Identifier: GPL-3.0-or-later
"""Factors of the BRDF that do not depend on the relief (docs/theory.md, BRDF).

wi is the unit direction to the light, wr to the viewer, both away from the surface. ti and tr are their angles from the
normal, and w = cos(ti) + cos(tr).
"""

import numpy as np

from .fresnel import KERATIN_IOR, fresnel_reflectance
from .small_slope import small_slope_times_cosine_and_w2

# The least index of the ratio form, a perfect mirror's; and what a table without the ratio form has in its place.
RATIO_IOR, NO_RATIO = 1.5, 1.0
# The largest index of the ratio form. Above it the light of all orders grows faster than the orders gain.
RATIO_IOR_MAX = 5.0


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


def ratio_ior_of(index: complex) -> float:
    """The index of the ratio form on a substrate of index n + ik: |n + ik|, from RATIO_IOR to RATIO_IOR_MAX.

    |n + ik| sets how Q falls towards the horizon. In comparisons with Maxwell's equations on metals it is as good as
    RATIO_IOR up to 60 degrees, and better beyond (docs/theory.md, BRDF)."""
    return min(max(abs(index), RATIO_IOR), RATIO_IOR_MAX)


def scattering_factor(
    wi: np.ndarray, wr: np.ndarray, ior: float | np.ndarray = KERATIN_IOR, *, ratio_ior: float = NO_RATIO,
    stam: bool = False,
) -> np.ndarray:  # fmt: skip
    """What turns a bake's scattered XYZ over w^2 into radiance under unit irradiance (...,), for unit directions.

    A dielectric has the small slope approximation (small_slope.py), or with `stam` Stam's form: Fresnel's reflectance
    at the half angle times the obliquity. A table that holds its matter's reflectance has either form at `ratio_ior`
    over Fresnel's reflectance there: the ratio form, or Stam's obliquity alone."""
    held = ratio_ior != NO_RATIO
    if stam:
        reflectance = 1.0 if held else fresnel_reflectance(half_angle_cosine(wi, wr), ior)
        return reflectance * obliquity_times_cosine_and_w2(wi, wr)
    if held:
        reflectance = fresnel_reflectance(half_angle_cosine(wi, wr), ratio_ior)
        return small_slope_times_cosine_and_w2(wi, wr, ratio_ior) / reflectance
    return small_slope_times_cosine_and_w2(wi, wr, ior)
