# SPDX-License-Identifier: GPL-3.0-or-later
"""Optics of a transparent plate over the relief: a disc's polycarbonate, or a foil's laminate.

In a plate of index n the wavelength is lambda / n, and Snell's law divides the tangential part of a direction by n. So
the relief under the plate scatters light of the wavelength lambda like a relief in air that is n times as large in
every dimension, its films too. A bake is made of this larger relief. Its u, v and w are those of the directions inside
the plate. This file leads from the directions outside to those inside, and gives the light that the front face lets
through.

Light that the front face reflects back onto the relief is left out. At normal incidence it is (n - 1)^2 / (n + 1)^2 of
the relief's light: 5 % for polycarbonate.
"""

import math

import numpy as np

from .fresnel import fresnel_reflectance

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


def plate_factor(wi: np.ndarray, wr: np.ndarray, ior: float) -> np.ndarray:
    """The radiance above a plate (...,), under unit irradiance of a surface that faces the lamp, over the radiance of
    the relief inside, under unit irradiance of a surface that faces the refracted light: T(ti) T(tr) cos(ti) / (n^2
    cos(ti')).

    wi and wr (..., 3) are unit vectors above the plate, ti' is the angle inside, T what the front face lets through.
    Refraction widens a beam to cos(ti') / cos(ti) of its width, and its solid angle n^2 times on the way out."""
    passed = passed_by_plate(wi, wr, ior)
    return passed if ior == NO_PLATE else passed * wi[..., 2] / (ior**2 * inside_plate(wi, ior)[..., 2])


def passed_by_plate(wi: np.ndarray, wr: np.ndarray, ior: float) -> np.ndarray:
    """What a plate's front face lets through on the ways in and out (...,): T(ti) T(tr), for unit vectors (..., 3)."""
    if ior == NO_PLATE:
        return np.ones(np.broadcast_shapes(wi.shape, wr.shape)[:-1])
    return (1 - fresnel_reflectance(wi[..., 2], ior)) * (1 - fresnel_reflectance(wr[..., 2], ior))


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
