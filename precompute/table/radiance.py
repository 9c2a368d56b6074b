# SPDX-License-Identifier: GPL-3.0-or-later
"""The radiance that a baked surface sends to a viewer under one lamp, by the Direct material's formula, in NumPy.

addon/materials/direct/direct_group.py builds the same formula from nodes, addon/materials/osl/direct.osl as a shader.
"""

from dataclasses import dataclass

import numpy as np

from ..colour.working_space import rgb_from_xyz
from ..optics.brdf import half_angle_cosine, obliquity_times_cosine_and_w2
from ..optics.fresnel import KERATIN_IOR, fresnel_reflectance
from .table import Table


@dataclass(frozen=True)
class Skin:
    """The material inputs that change what the relief reflects. The defaults keep the relief as baked.

    roughness          of the skin over the relief; its slopes have the variance roughness^4 / 2, as in a Beckmann lobe
    period_scale       stretches the relief along the surface
    height_scale       scales the relief's heights
    ior                index of refraction of the skin, relative to air
    energy_conserving  1 divides by the albedo bound, 0 keeps Stam's form
    """

    roughness: float = 0.0
    period_scale: float = 1.0
    height_scale: float = 1.0
    ior: float = KERATIN_IOR
    energy_conserving: float = 1.0


AS_BAKED = Skin()
# A Gaussian is 0 in double precision from here on, in standard deviations: exp(-38.7^2 / 2) = 6e-326.
_KERNEL_ENDS = 38.7


def reflected_xyz(
    table: Table, wi: np.ndarray, wr: np.ndarray, *, variance: np.ndarray | float = 0.0, skin: Skin = AS_BAKED
) -> np.ndarray:
    """Radiance in XYZ (n, 3) under unit irradiance, for unit vectors wi (3,) or (n, 3) to the lamp and wr (n, 3) to the
    viewer along (T, B, N), both above the surface.

    `variance`, a number or (n,) in rad2, is the variance of the lamp's disc in the sky, along one axis. Unit irradiance
    is that of a surface that faces the lamp. The formula is Stam's (Stam 1999, equation 5) divided by the albedo bound
    M (docs/theory.md, "BRDF"):

        R / M [(1 + wi.wr)^2 / cos(tr) p^2 c^2 S(p u, p v, c w) + cos(ti) Z(c w) kernel(u, v)]

    R is the Fresnel reflectance at the half angle. S is the table's scattered XYZ over w^2, 0 outside the table, and Z
    the colour of its zero order. p is the period scale and c the height scale."""
    u, v, w = (wi + wr).T
    cos_i = wi[..., 2]
    blur = np.maximum(variance * (1 + cos_i**2) / 2 - table.sigma_b**2, 0) + (w * skin.roughness**2) ** 2 / 2
    p, c = skin.period_scale, skin.height_scale
    inside = ((p * u) ** 2 + (p * v) ** 2 < 4) & table.holds(p * u, p * v, c * w)
    xyz = inside[:, None] * table.scattered_over_w2(p * u, p * v, c * w, variance=blur * p**2)
    xyz *= (obliquity_times_cosine_and_w2(wi, wr) * (p * c) ** 2)[:, None]
    near = np.flatnonzero(u**2 + v**2 < _KERNEL_ENDS**2 * (table.sigma_b**2 + blur))
    mirrored = np.broadcast_to(cos_i, u.shape)[near] * table.kernel(u[near], v[near], blur[near])
    xyz[near] += mirrored[:, None] * table.zero_order_xyz(c * w[near])
    reflectance = fresnel_reflectance(half_angle_cosine(wi, wr), skin.ior)
    if skin.energy_conserving:
        bound = np.maximum(table.albedo_bound_at(wi), table.albedo_bound_at(wr))
        reflectance /= 1 + skin.energy_conserving * (bound - 1)
    return xyz * reflectance[:, None]


def lamp_radiance(
    table: Table,
    wi: np.ndarray,
    wr: np.ndarray,
    *,
    irradiance: np.ndarray,
    variance: np.ndarray | float = 0.0,
    skin: Skin = AS_BAKED,
) -> np.ndarray:
    """Radiance in linear Rec.709 (n, 3), W/m2/sr, by reflected_xyz, for wi, wr (n, 3).

    `irradiance` (3,) or (n, 3) in W/m2 is that of a surface that faces the lamp. The radiance is 0 if the lamp or the
    viewer is below the surface. Negative components are clipped, as in a renderer."""
    lit = (wi[:, 2] > 0) & (wr[:, 2] > 0)
    rgb = reflected_xyz(table, wi, wr, variance=variance, skin=skin) @ rgb_from_xyz("Rec.709").T
    return np.maximum(rgb, 0) * irradiance * lit[:, None]
