# SPDX-License-Identifier: GPL-3.0-or-later
"""The thesis's gain with Schlick's reflectance and its blending with a texture (Algorithm 4).

The product uses neither; they are kept for comparison."""

import numpy as np

from precompute.optics.brdf import half_angle_cosine, obliquity_times_cosine_and_w2

THESIS_IOR = 1.5
THESIS_DIFFUSE_WEIGHT = 0.1


def fresnel_schlick(cosine: np.ndarray, ior: float = THESIS_IOR) -> np.ndarray:
    """Schlick's approximation (...,): F0 + (1 - F0) (1 - cosine)^5, F0 = ((ior - 1) / (ior + 1))^2 (Schlick 1994)."""
    normal = ((ior - 1) / (ior + 1)) ** 2
    return normal + (1 - normal) * (1 - np.clip(cosine, 0, 1)) ** 5


def relative_reflectance(wi: np.ndarray, wr: np.ndarray, samples: int, *, ior: float = THESIS_IOR) -> np.ndarray:
    """The thesis's gain C (...,) for unit directions (..., 3):

        C = F^2 (1 + wi.wr)^2 / (F0^2 (cos ti + cos tr)^2 cos tr samples^2)

    F is Schlick's reflectance at the half angle, F0 at normal incidence. C times the |DFT|^2 of a phasor of `samples`
    pixels is brightness relative to a mirror seen along its normal. This is not radiometric: F is squared although it
    is already a power, and the width of a mirror's peak is proportional to the wavelength."""
    ratio = fresnel_schlick(half_angle_cosine(wi, wr), ior) / fresnel_schlick(np.ones(()), ior)
    w = wi[..., 2] + wr[..., 2]
    return ratio**2 * obliquity_times_cosine_and_w2(wi, wr) / np.maximum(w, 1e-6) ** 2 / samples**2


def blend_texture(
    diffraction: np.ndarray, texture: np.ndarray, fresnel: np.ndarray, *, diffuse_weight: float = THESIS_DIFFUSE_WEIGHT
) -> np.ndarray:
    """Blend diffraction (..., 3) over texture (..., 3), linear colours, with fresnel (...,) of any sign:

        (1 - wd) diffraction + (1 - alpha) texture + wd texture, alpha = min(|fresnel|, 1).

    As in the thesis the weights add up to 2 - alpha, so energy is not conserved where alpha < 1."""
    alpha = np.minimum(np.abs(fresnel), 1)[..., None]
    return (1 - diffuse_weight) * diffraction + (1 - alpha + diffuse_weight) * texture
