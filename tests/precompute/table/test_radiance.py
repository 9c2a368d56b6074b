# SPDX-License-Identifier: GPL-3.0-or-later
"""The radiance of a bake under a lamp that is a disc."""

import numpy as np
import pytest

from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import sinusoidal
from precompute.table.radiance import Skin, reflected_xyz


@pytest.fixture(scope="module")
def table():
    return bake(prepare(sinusoidal(periods=3, rows=48)), BakeRequest(coherence_length_m=6e-6, delta_e=2))


@pytest.mark.parametrize("theta_deg", [0.0, 50.0])
def test_a_tilted_disc_blurs_by_the_mean_of_its_axes(table, theta_deg):
    """In (u, v) a disc at the angle t has its variance across the plane of incidence, and cos^2(t) of it in that plane.
    A round kernel has the mean of both. It widens the baked one as a roughness r does, by (w r^2)^2 / 2."""
    theta, variance = np.radians(theta_deg), np.radians(6) ** 2
    wi = np.array([0.0, np.sin(theta), np.cos(theta)])
    # Five standard deviations of the roughness's mirror image, which each widens in its own way, are 0.52.
    u = np.linspace(0.52, 0.62, 20)
    wr = np.stack([u, 0 * u - wi[1], np.sqrt(1 - u**2 - wi[1] ** 2)], axis=1)
    mean = (variance - table.sigma_b**2) * (1 + wi[2] ** 2) / 2
    for each in wr:
        roughness = (2 * mean / (wi[2] + each[2]) ** 2) ** 0.25
        wide = reflected_xyz(table, wi[None], each[None], variance=variance)
        rough = reflected_xyz(table, wi[None], each[None], skin=Skin(roughness=roughness), variance=table.sigma_b**2)
        assert wide.max() > 0
        np.testing.assert_allclose(wide, rough, rtol=1e-5)
