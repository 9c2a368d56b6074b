# SPDX-License-Identifier: GPL-3.0-or-later
"""The mirror image of a lamp: the disc itself on a smooth surface, a Gaussian on a rough one."""

import numpy as np
import pytest

from precompute.optics.mirror_image import LEAST_VARIANCE, mirror_kernel


def image(theta, *, variance, roughness):
    """The kernel (n,) around the mirror direction of a viewer at theta, the solid angles (n,) and the angles (n,) in
    the plane of incidence and across it."""
    reach = 2.5 * np.sqrt(variance) + 7 * np.sqrt(2) * roughness**2
    steps = (np.arange(601) - 300) / 300 * reach
    along, across = (each.ravel() for each in np.meshgrid(steps, steps))
    tilted = theta + along
    wi = np.stack([np.sin(tilted) * np.cos(across), np.sin(across), np.cos(tilted) * np.cos(across)], axis=-1)
    wr = np.broadcast_to((-np.sin(theta), 0, np.cos(theta)), wi.shape)
    solid_angle = np.cos(across) * (reach / 300) ** 2
    return mirror_kernel(wi, wr, variance=variance, roughness=roughness), solid_angle, along, across


@pytest.mark.parametrize("diameter_deg", [0.5, 1.5, 5])
@pytest.mark.parametrize("theta_deg", [0, 60, 85])
def test_a_smooth_surface_shows_the_disc(diameter_deg, theta_deg):
    """The soft edge adds 1/64 of the variance. In a disc, each point has one over its area."""
    radius = np.radians(diameter_deg / 2)
    kernel, solid_angle, along, across = image(np.radians(theta_deg), variance=radius**2 / 4, roughness=0)
    assert kernel @ solid_angle == pytest.approx(1, rel=3e-3)  # tan(2.5 degrees)^2, and the grid's steps
    variances = [(kernel * solid_angle) @ each**2 for each in (along, across)]
    np.testing.assert_allclose(variances, radius**2 / 4, rtol=0.025)
    assert kernel.max() == pytest.approx(1 / (np.pi * radius**2), rel=1e-6)


@pytest.mark.parametrize(("theta_deg", "tolerance"), [(0, 0.02), (45, 0.02), (70, 0.06)])
@pytest.mark.parametrize("share", [0.01, 0.3, 1, 30])
def test_a_rough_surface_blurs_the_disc(theta_deg, tolerance, share):
    """`share` is the blur's variance over the disc's. The variances are right within 1 %, and 1/64 of the disc's is its
    soft edge. At 70 degrees the kernel reaches 8 degrees in the plane of incidence, over which cos(t) changes."""
    theta, disc = np.radians(theta_deg), 1e-5
    alpha2 = share * disc / 2
    kernel, solid_angle, along, across = image(theta, variance=disc, roughness=alpha2**0.25)
    assert kernel @ solid_angle == pytest.approx(1, rel=tolerance)
    variances = [(kernel * solid_angle) @ each**2 for each in (along, across)]
    expected = disc + 2 * alpha2, disc + 2 * alpha2 * np.cos(theta) ** 2
    np.testing.assert_allclose(variances, expected, rtol=2 * tolerance)


@pytest.mark.parametrize("roughness", [0.1, 0.5, 1])
def test_under_a_point_lamp_a_rough_surface_shows_a_gaussian(roughness):
    """Beckmann's slopes at the normal. The least q changes the peak by half a percent."""
    wr = np.array([[0, 0, 1.0], [0.02 * roughness**2, 0, 1]])
    wr /= np.linalg.norm(wr, axis=1, keepdims=True)
    kernel = mirror_kernel(np.array([0, 0, 1.0]), wr, roughness=roughness)
    np.testing.assert_allclose(kernel, 1 / (4 * np.pi * roughness**4), rtol=0.006 + 2e-2 * (roughness < 0.2))


def test_a_point_lamp_has_the_least_disc():
    """Its radius is 2 mrad. At 3 mrad the soft edge has fallen to 1e-8 of the peak."""
    wi, wr = np.array([0, 0, 1.0]), np.array([[0, 0, 1.0], [0, 3e-3, 1.0]])
    peak = 1 / (4 * np.pi * LEAST_VARIANCE)
    np.testing.assert_allclose(mirror_kernel(wi, wr), [peak, 0], rtol=1e-6, atol=1e-8 * peak)
