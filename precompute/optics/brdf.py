# SPDX-License-Identifier: GPL-3.0-or-later
"""The factors of the BRDF that do not depend on the relief (docs/theory.md, BRDF).

wi is the unit direction to the light, wr to the viewer, both away from the surface; ti and tr are their angles from the
normal, w = cos(ti) + cos(tr).
"""

import numpy as np

from .fresnel import THESIS_IOR, fresnel_schlick


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The scalar products (...,) of vectors (..., 3)."""
    return np.einsum("...i,...i->...", a, b)


def half_angle_cosine(wi: np.ndarray, wr: np.ndarray) -> np.ndarray:
    """The cosine (...,) of the half angle: between wi (..., 3) and the half vector of wi and wr (..., 3)."""
    return np.sqrt(np.clip(0.5 * (1 + dot(wi, wr)), 0, 1))


def obliquity_times_cosine_and_w2(wi: np.ndarray, wr: np.ndarray) -> np.ndarray:
    """O(wi, wr) cos(ti) w^2 = (1 + wi.wr)^2 / cos(tr) (...,) for unit directions (..., 3) (Stam 1999, equation 5).

    Stam's obliquity O has w^2 in its denominator, and the scattered spectrum vanishes as w^2. So the bake stores the
    spectrum divided by w^2, and this function returns O cos(ti) multiplied by w^2. The product of the two is never a
    quotient by a small number, except where the view itself grazes; there cos(tr) is held at 1e-6."""
    return (1 + dot(wi, wr)) ** 2 / np.maximum(wr[..., 2], 1e-6)


def relative_reflectance(wi: np.ndarray, wr: np.ndarray, samples: int, *, ior: float = THESIS_IOR) -> np.ndarray:
    """The thesis's gain C (...,) for unit directions (..., 3):

        C = F^2 (1 + wi.wr)^2 / (F0^2 (cos ti + cos tr)^2 cos tr samples^2)

    F is Schlick's reflectance at the half angle, and F0 is Schlick's reflectance at normal incidence. Multiplied by C,
    the |DFT|^2 of a phasor of `samples` pixels becomes brightness relative to a mirror seen along its normal. This is
    not radiometric: F is squared although it is a power already, and the width of a mirror's peak is proportional to
    the wavelength. The gain is kept for comparison with the thesis."""
    ratio = fresnel_schlick(half_angle_cosine(wi, wr), ior) / fresnel_schlick(np.ones(()), ior)
    w = wi[..., 2] + wr[..., 2]
    return ratio**2 * obliquity_times_cosine_and_w2(wi, wr) / np.maximum(w, 1e-6) ** 2 / samples**2
