# SPDX-License-Identifier: GPL-3.0-or-later
"""Texture blending (thesis Algorithm 4): diffraction over the colours that an artist painted."""

import numpy as np

THESIS_DIFFUSE_WEIGHT = 0.1


def blend_texture(
    diffraction: np.ndarray, texture: np.ndarray, fresnel: np.ndarray, *, diffuse_weight: float = THESIS_DIFFUSE_WEIGHT
) -> np.ndarray:
    """Colour (..., 3) of diffraction (..., 3) over texture (..., 3), all linear, with fresnel (...,) of any sign:

    (1 - wd) diffraction + (1 - alpha) texture + wd texture, alpha = min(|fresnel|, 1).

    The weights add up to 2 - alpha, so that energy is not conserved where alpha < 1. The thesis has it so."""
    alpha = np.minimum(np.abs(fresnel), 1)[..., None]
    return (1 - diffuse_weight) * diffraction + (1 - alpha + diffuse_weight) * texture
