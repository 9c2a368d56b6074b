# SPDX-License-Identifier: GPL-3.0-or-later
"""Optics of a transparent plate over the relief: a disc's polycarbonate, or a foil's laminate.

In a plate of index n the wavelength is lambda / n, and Snell's law divides the tangential part of a direction by n. So
the relief under the plate scatters light of the wavelength lambda like a relief in air that is n times as large in
every dimension, its films too. A bake is made of this larger relief. Its u, v and w are those of the directions inside
the plate. This file leads from the directions outside to those inside, and gives the light that the front face lets
through.

The face returns the rest to the relief, which sends it out in the same directions. A bake holds how much more light
this is (table/plate_gains.py).
"""

import math

import numpy as np

from .brdf import fresnel_reflectance

# The index of no plate, and the greatest index of a plate.
NO_PLATE = 1.0
PLATE_IOR_MAX = 3.0


def inside_plate(directions: np.ndarray, ior: float) -> np.ndarray:
    """The directions inside a plate (..., 3) of light that has the directions (..., 3) above it; unit vectors."""
    tangential = directions[..., :2] / ior
    cosine = np.sqrt(1 - np.sum(tangential**2, axis=-1, keepdims=True))
    return np.concatenate([tangential, cosine], axis=-1)


def least_cosine(ior: float) -> float:
    """The least cosine of a direction inside a plate: that of the critical angle. The front face reflects all other
    light back."""
    return math.sqrt(1 - 1 / ior**2)


def face_reflectance(tangential: np.ndarray, ior: float) -> np.ndarray:
    """The share (...,) of light that a plate's face returns to the relief, given the tangential parts (..., 2) of
    directions inside: Fresnel's reflectance, and 1 beyond the critical angle."""
    cosine2 = 1 - ior**2 * np.sum(tangential**2, axis=-1)
    return np.where(cosine2 > 0, fresnel_reflectance(np.sqrt(np.maximum(cosine2, 0)), ior), 1.0)


def passed(wi: np.ndarray, wr: np.ndarray, ior: float) -> np.ndarray:
    """What the front face lets through (...,) on both ways, T(ti) T(tr), for unit vectors (..., 3) above the plate."""
    return (1 - fresnel_reflectance(wi[..., 2], ior)) * (1 - fresnel_reflectance(wr[..., 2], ior))


def refracted(wi: np.ndarray, ior: float) -> np.ndarray:
    """The radiance above a plate (...,), under unit irradiance of a surface that faces the lamp, over the radiance of
    the relief inside, under unit irradiance of a surface that faces the refracted light, if the front face let all
    light through: cos(ti) / (n^2 cos(ti')).

    wi (..., 3) is a unit vector above the plate, ti' the angle inside. Refraction widens a beam to cos(ti') / cos(ti)
    of its width, and its solid angle n^2 times on the way out."""
    return wi[..., 2] / (ior**2 * inside_plate(wi, ior)[..., 2])


def w_inside_plate(w: tuple[float, float], ior: float) -> tuple[float, float]:
    """The range of w = cos(ti) + cos(tr) inside a plate, given the range above it.

    The cosine inside is a convex function of the cosine above, so w inside is least if both cosines are equal, and
    greatest if one of them is at its end."""

    def inside(cosine: float) -> float:
        return math.sqrt(1 - (1 - cosine**2) / ior**2)

    low, high = w
    return 2 * inside(low / 2), inside(min(high, 1.0)) + inside(max(high - 1, 0.0))


def w_above_plate(w: tuple[float, float], ior: float) -> tuple[float, float]:
    """The range of w above a plate, given the range inside; inverts w_inside_plate. A range that begins below all light
    gives 0."""

    def above(cosine: float) -> float:
        return math.sqrt(max(1 - (1 - cosine**2) * ior**2, 0.0))

    (low, high), least = w, least_cosine(ior)
    return 2 * above(low / 2), above(high - least) if high <= 1 + least else 1 + above(high - 1)
