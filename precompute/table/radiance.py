# SPDX-License-Identifier: GPL-3.0-or-later
"""The radiance that a baked surface sends to a viewer under one lamp, by the Direct material's formula, in NumPy.

addon/materials/direct/direct_group.py builds the same formula from nodes, addon/materials/osl/direct.osl as a shader.
"""

from dataclasses import dataclass

import numpy as np

from ..colour.gamut import shown_rgb
from ..colour.working_space import rgb_from_xyz
from ..optics.brdf import half_angle_cosine, scattering_factor
from ..optics.fresnel import KERATIN_IOR, fresnel_reflectance
from ..optics.plate import NO_PLATE, inside_plate, passed, refracted
from ..optics.small_slope import IOR_MAX
from .table import Table


@dataclass(frozen=True)
class Skin:
    """The material inputs that change what the relief reflects. The defaults keep the relief as baked.

    roughness          of the skin over the relief; its slopes have the variance roughness^4 / 2, as in a Beckmann lobe
    period_scale       stretches the relief along the surface
    height_scale       scales the relief's heights
    ior                index of refraction of the skin, relative to air; a dielectric's ends at IOR_MAX
    """

    roughness: float = 0.0
    period_scale: float = 1.0
    height_scale: float = 1.0
    ior: float = KERATIN_IOR


AS_BAKED = Skin()
# A Gaussian is 0 in double precision from here on, in standard deviations: exp(-38.7^2 / 2) = 6e-326.
_KERNEL_ENDS = 38.7


def reflected_xyz(
    table: Table,
    wi: np.ndarray,
    wr: np.ndarray,
    *,
    variance: np.ndarray | float = 0.0,
    skin: Skin = AS_BAKED,
    stam: bool = False,
) -> np.ndarray:
    """Radiance in XYZ (n, 3) under unit irradiance, for unit vectors wi (3,) or (n, 3) to the lamp and wr (n, 3) to the
    viewer along (T, B, N), both above the surface.

    `variance`, a number or (n,) in rad2, is the variance of the lamp's disc in the sky, along one axis. Unit irradiance
    is that of a surface that faces the lamp. The formula for a dielectric (docs/theory.md, "BRDF") is

        4 cos(ti)^2 cos(tr) Q p^2 c^2 S(p u, p v, c w) + R cos(ti) Z(c w) kernel(u, v)

    Q is the small slope reflectance (optics/small_slope.py), R the Fresnel reflectance at the half angle, S the table's
    scattered XYZ over w^2, 0 outside the table, and Z the colour of its zero order. p is the period scale and c the
    height scale. A table that holds its matter's reflectance has (1 + wi.wr)^2 / cos(tr) in place of 4 cos(ti)^2
    cos(tr) Q, and 1 in place of R; the albedo bound divides all of it. `stam` asks for Stam's form (Stam 1999, equation
    5), without the bound and in a single pass through a plate. Under a plate, the formula has the directions inside,
    and the result is multiplied by what the plate lets through and by its refraction (plate_gains.py, optics/plate.py).
    The disc's variance is then divided by the square of the plate's index."""
    plate_ior = table.plate_ior
    shortened = (1 + wi[..., 2] ** 2) / 2
    above, gains = (wi, wr), None if stam else table.gains
    refraction = through = np.ones((len(wr), 1))
    if plate_ior != NO_PLATE:
        refraction = np.reshape(refracted(wi, plate_ior), (-1, 1))
        through = np.reshape(passed(wi, wr, plate_ior), (-1, 1))
        wi, wr = inside_plate(wi, plate_ior), inside_plate(wr, plate_ior)
    holds = table.holds_reflectance
    ior = None if holds else skin.ior if stam else min(skin.ior, IOR_MAX)
    u, v, w = (wi + wr).T
    cos_i = wi[..., 2]
    disc = np.maximum(variance / plate_ior**2 - table.sigma_b**2, 0) * shortened
    blur = disc + (w * skin.roughness**2) ** 2 / 2
    p, c = skin.period_scale, skin.height_scale
    inside = ((p * u) ** 2 + (p * v) ** 2 < (2 / plate_ior) ** 2) & table.holds(p * u, p * v, c * w)
    xyz = inside[:, None] * table.scattered_over_w2(p * u, p * v, c * w, variance=blur * p**2)
    xyz *= (scattering_factor(wi, wr, ior, stam=stam) * (p * c) ** 2)[:, None]
    xyz *= through if gains is None else gains.of_scattered(*above)[:, None]
    near = np.flatnonzero(u**2 + v**2 < _KERNEL_ENDS**2 * (table.sigma_b**2 + blur))
    mirrored = np.broadcast_to(cos_i, u.shape)[near] * table.kernel(u[near], v[near], blur[near])
    if ior is not None:
        mirrored *= fresnel_reflectance(half_angle_cosine(wi, wr), ior)[near]
    zero_order = through[near] * table.zero_order_xyz(c * w[near])
    if gains is not None:
        zero_order += gains.mirror_xyz(above[1][near])
    xyz[near] += mirrored[:, None] * zero_order
    return refraction * (xyz if stam else xyz / np.reshape(table.bound_of(wi, wr), (-1, 1)))


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
    viewer is below the surface. No component is negative (colour/gamut.py)."""
    lit = (wi[:, 2] > 0) & (wr[:, 2] > 0)
    xyz = reflected_xyz(table, wi, wr, variance=variance, skin=skin)
    return shown_rgb(xyz, rgb_from_xyz("Rec.709")) * irradiance * lit[:, None]
