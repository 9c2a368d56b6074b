# SPDX-License-Identifier: GPL-3.0-or-later
"""Factors of the BRDF that do not depend on the relief (docs/theory.md, BRDF).

wi is the unit direction to the light, wr to the viewer, both away from the surface. ti and tr are their angles from the
normal, and w = cos(ti) + cos(tr). In the first-order small slope approximation (Voronovich 1994, chapter 5) the BRDF
of a dielectric's relief with the power spectrum PSD is

    f = 4 cos(ti) cos(tr) Q(wi, wr; n) / w^2 * PSD((u, v) / lambda; w / lambda) / lambda^2

For shallow reliefs it is exact at all angles: Q is the first-order solution of Maxwell's equations (Rice 1951),
averaged over polarisations. In the direction of the mirror image Q is the Fresnel reflectance. Q is symmetric in wi and
wr. `./dev bench rcwa_orders` compares it with Stam's obliquity."""

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

    A dielectric has the small slope approximation, or with `stam` Stam's form: Fresnel's reflectance
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
