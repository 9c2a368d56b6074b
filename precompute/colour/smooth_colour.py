# SPDX-License-Identifier: GPL-3.0-or-later
"""The colour of a smooth surface of a matter, by the angle that it is seen at."""

import numpy as np

from ..optics.brdf import fresnel_reflectance
from ..reflectance.matter import Matter
from .observer import seen_wavelengths, spectral_weights, wavelengths
from .spaces import rgb_from_xyz, shown_rgb

# Fringes of a layer of 10 um are 10 nm apart at 450 nm.
_STEP_M = 2e-9
# The least cosine. At 0 the front face of a plate reflects all light, and the formula below divides 0 by 0.
_COSINE_MIN = 1e-6


def smooth_colour(
    matter: Matter, cosines: np.ndarray, *, space: str = "Rec.709", illuminant: str = "D65"
) -> np.ndarray:
    """Linear RGB of a space, then the luminance, of what a smooth surface reflects, (m, 4). A perfect mirror has the
    luminance 1.

    The cosines (m,) are of the angle of incidence in air. R = `matter.reflectance` and the reflectance r of a plate's
    front face add up incoherently, with all reflections between both: r + (1 - r)^2 R / (1 - r R)."""
    cosines = np.maximum(cosines, _COSINE_MIN)
    lambdas = seen_wavelengths(wavelengths(_STEP_M), illuminant)
    n = matter.plate_ior
    inside = matter.reflectance(lambdas, np.sqrt(1 - (1 - cosines**2) / n**2))
    face = fresnel_reflectance(cosines, n)
    xyz = (face + (1 - face) ** 2 * inside / (1 - face * inside)).T @ spectral_weights(lambdas, illuminant)
    return np.column_stack([shown_rgb(xyz, rgb_from_xyz(space, illuminant)), xyz[:, 1]])
