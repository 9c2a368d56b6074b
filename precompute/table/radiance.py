# SPDX-License-Identifier: GPL-3.0-or-later
"""The light that a baked surface sends to the viewer under one lamp.

This is the formula of the node group (addon/materials/direct/group.py) in NumPy.
"""

import numpy as np

from ..colour.working_space import rgb_from_xyz
from ..optics.brdf import half_angle_cosine, obliquity_times_cosine_and_w2
from ..optics.fresnel import KERATIN_IOR, fresnel_reflectance
from .table import Table


def lamp_radiance(
    bake: Table,
    wi: np.ndarray,
    wr: np.ndarray,
    irradiance: np.ndarray,
    variance: np.ndarray | float = 0.0,
    roughness: float = 0.0,
    period_scale: float = 1.0,
    height_scale: float = 1.0,
    ior: float = KERATIN_IOR,
    conserving: float = 1.0,
) -> np.ndarray:
    """Radiance in linear Rec.709 (n, 3), in W/m2/sr, for unit vectors wi to the light and wr to the viewer, (n, 3).

    The vectors are in the surface's frame (T, B, N). `irradiance` (n, 3), in W/m2, is that of a surface which faces the
    light. `variance` (n,), in rad2, is that of the light's disc. `roughness` is Blender's, alpha = roughness^2, of the
    skin over the relief. `period_scale` and `height_scale` stretch the relief's periods and heights. `ior` is the
    refractive index. `conserving`, from 0 to 1, leads from Stam's form to the energy-conserving one. A light or a
    viewer below the surface gives 0."""
    u, v, w = (wi + wr).T
    cos_i = wi[:, 2]
    blur = np.maximum(variance * (1 + cos_i**2) / 2 - bake.sigma_b**2, 0) + (w * roughness**2) ** 2 / 2
    p, c = period_scale, height_scale
    inside = (p * u) ** 2 + (p * v) ** 2 < 4
    xyz = inside[:, None] * bake.scattered_over_w2(p * u, p * v, c * w, blur * p**2)
    xyz *= (obliquity_times_cosine_and_w2(wi, wr) * (p * c) ** 2)[:, None]
    xyz += (cos_i * bake.kernel(u, v, blur))[:, None] * bake.zero_order_xyz(c * w)
    bound = 1 + conserving * (np.maximum(bake.albedo_bound_at(wi), bake.albedo_bound_at(wr)) - 1)
    xyz *= (fresnel_reflectance(half_angle_cosine(wi, wr), ior) / bound)[:, None]
    lit = (cos_i > 0) & (wr[:, 2] > 0)
    # A renderer's colours are not negative.
    return np.maximum(xyz @ rgb_from_xyz("Rec.709").T, 0) * irradiance * lit[:, None]
