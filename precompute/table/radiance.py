# SPDX-License-Identifier: GPL-3.0-or-later
"""The radiance that a baked surface sends to a viewer under one lamp, by the Direct material's formula, in NumPy.

addon/materials/direct/direct_group.py builds the same formula from nodes, addon/materials/osl/direct.osl as a shader.
"""

from dataclasses import dataclass

import numpy as np

from ..colour.spaces import rgb_from_xyz, shown_rgb
from ..optics.brdf import IOR_MAX, KERATIN_IOR, fresnel_reflectance, half_angle_cosine, scattering_factor
from ..optics.mirror_image import mirror_kernel
from ..optics.plate import NO_PLATE, inside_plate, passed, refracted
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

        4 cos(ti)^2 cos(tr) Q p^2 c^2 S(p u, p v, c w) + R Z(c w) kernel(wi, wr)

    Q is the small slope reflectance (optics/brdf.py), R the Fresnel reflectance at the half angle, S the table's
    scattered XYZ over w^2, 0 outside the table, and Z the colour of its zero order. The kernel is that of a lamp's
    image in a mirror (optics/mirror_image.py). p is the period scale and c the height scale. A table that holds its
    matter's reflectance has Q / R at its ratio_ior (optics/brdf.py) in place of Q, and 1 in place of R. `stam` asks for
    Stam's form (Stam 1999, equation 5), in a single pass through a plate. Under a plate, the scattered light has the
    directions inside, and is multiplied by what the plate lets through and by its refraction (plate_gains.py,
    optics/plate.py). The disc's variance is then divided by the square of the plate's index.

    >>> table, _ = read_bake(Path("bakes/blazed.exr"))
    >>> wi, wr = light_from(0.5), np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
    >>> reflected_xyz(table, wi, wr, variance=table.kernel_variance).shape
    (2, 3)"""
    kernel = mirror_kernel(wi, wr, variance=variance, roughness=skin.roughness)
    near = np.flatnonzero(kernel)
    lamp = np.broadcast_to(wi, wr.shape)
    mirrored = kernel[near, None] * zero_order_reflectance(table, lamp[near], wr[near], skin=skin, stam=stam)
    plate_ior = table.plate_ior
    shortened = (1 + wi[..., 2] ** 2) / 2
    let_out = np.ones((len(wr), 1))
    if plate_ior != NO_PLATE:
        gains = None if stam else table.gains
        through = passed(wi, wr, plate_ior) if gains is None else gains.of_scattered(wi, wr)
        let_out = np.reshape(through * refracted(wi, plate_ior), (-1, 1))
        wi, wr = inside_plate(wi, plate_ior), inside_plate(wr, plate_ior)
    ior = skin.ior if stam else min(skin.ior, IOR_MAX)
    u, v, w = (wi + wr).T
    disc = np.maximum(variance / plate_ior**2 - table.sigma_b**2, 0) * shortened
    blur = disc + (w * skin.roughness**2) ** 2 / 2
    p, c = skin.period_scale, skin.height_scale
    inside = ((p * u) ** 2 + (p * v) ** 2 < (2 / plate_ior) ** 2) & table.holds(p * u, p * v, c * w)
    xyz = inside[:, None] * table.scattered_over_w2(p * u, p * v, c * w, variance=blur * p**2)
    xyz *= (scattering_factor(wi, wr, ior, ratio_ior=table.ratio_ior, stam=stam) * (p * c) ** 2)[:, None]
    xyz *= let_out
    xyz[near] += mirrored
    return xyz


def zero_order_reflectance(
    table: Table, wi: np.ndarray, wr: np.ndarray, *, skin: Skin = AS_BAKED, stam: bool = False
) -> np.ndarray:
    """What the mirror image reflects, in XYZ (n, 3), for unit vectors wi and wr (n, 3) to the lamp and to the viewer:
    R Z of reflected_xyz, with what a plate lets through and gives back."""
    above, through = wr, np.ones((len(wr), 1))
    if table.plate_ior != NO_PLATE:
        through = passed(wi, wr, table.plate_ior)[:, None]
        wi, wr = inside_plate(wi, table.plate_ior), inside_plate(wr, table.plate_ior)
    xyz = through * table.zero_order_xyz(skin.height_scale * (wi + wr)[:, 2])
    if table.gains is not None and not stam:
        xyz += table.gains.mirror_xyz(above)
    if not table.holds_reflectance:
        ior = skin.ior if stam else min(skin.ior, IOR_MAX)
        xyz *= fresnel_reflectance(half_angle_cosine(wi, wr), ior)[:, None]
    return xyz


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
    viewer is below the surface. No component is negative (colour/spaces.py)."""
    lit = (wi[:, 2] > 0) & (wr[:, 2] > 0)
    xyz = reflected_xyz(table, wi, wr, variance=variance, skin=skin)
    return shown_rgb(xyz, rgb_from_xyz("Rec.709")) * irradiance * lit[:, None]
