# SPDX-License-Identifier: GPL-3.0-or-later
"""A surface's albedo in a white world, in cases with a known result."""

import numpy as np
import pytest

from laboratory.benchmarks.hemisphere import directional_albedo
from precompute.colour.observer import white_xyz
from precompute.optics.brdf import KERATIN_IOR, NO_RATIO, RATIO_IOR, fresnel_reflectance
from precompute.table.table import Table

SIGMA_B = 0.02


def white_table(scattered, mirrored, *, metal=False):
    """A table of white light: `scattered` over w^2 in every (u, v), and `mirrored` in the zero order."""
    terms = np.zeros((2, 29, 29, 3), np.float32)
    terms[0] = scattered * white_xyz()
    return Table(
        terms, np.tile(mirrored * white_xyz(), (20, 1)), SIGMA_B, 4 / 24, "D65", RATIO_IOR if metal else NO_RATIO
    )


@pytest.mark.parametrize("metal", [False, True])
@pytest.mark.parametrize("degrees", [0, 60, 89])
def test_a_mirror_reflects_what_its_surface_does(degrees, metal):
    """A metal's reflectance is in its table, here 1. The matrix to RGB is rounded to seven digits."""
    theta = np.radians(degrees)
    wanted = 1.0 if metal else fresnel_reflectance(np.cos(theta))
    np.testing.assert_allclose(directional_albedo(white_table(0, 1, metal=metal), theta), wanted, rtol=1e-6)


@pytest.mark.parametrize("metal", [False, True])
def test_even_scatter_is_an_integral_of_one_angle(metal):
    """Seen along the normal. A dielectric has 4 cos^2 Q over the hemisphere, a metal the same over Fresnel's R.

    Q is the mean over the polarisations of (n - 1)^2 / (c + g)^2 and (n - 1)^2 g^2 / (n^2 c + g)^2, where c is the
    cosine and g = sqrt(n^2 - 1 + c^2)."""
    step = np.pi / 2 / 1000
    theta = (np.arange(1000) + 0.5) * step
    n, c = RATIO_IOR if metal else KERATIN_IOR, np.cos(theta)
    g = np.sqrt(n**2 - 1 + c**2)
    q = (n - 1) ** 2 * ((c + g) ** -2 + (g / (n**2 * c + g)) ** 2) / 2
    factor = 4 * c**2 * q / (fresnel_reflectance(np.cos(theta / 2), n) if metal else 1)
    # The midpoint rule has an error of step^2 / 24 = 1e-7 here, times numbers of order one.
    wanted = 2 * np.pi * 0.3 * (factor * np.sin(theta)).sum() * step
    np.testing.assert_allclose(directional_albedo(white_table(0.3, 0, metal=metal), 0.0), wanted, rtol=1e-6)
