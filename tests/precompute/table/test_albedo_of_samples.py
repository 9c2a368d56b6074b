# SPDX-License-Identifier: GPL-3.0-or-later
"""No sample surface reflects more than arrives, whatever its index of refraction.

Seen from a direction in a white world of radiance 1, a surface has its directional albedo as its luminance: the BRDF is
reciprocal. So the albedo is an integral of reflected_xyz over the lamp's direction, for the scattered light, plus what
the mirror image reflects."""

import math

import numpy as np
import pytest

from laboratory.benchmarks.hemisphere import mirror_of, without_mirror
from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.optics.brdf import IOR_MAX, fresnel_reflectance
from precompute.surface.relief import prepare
from precompute.surface.samples.catalogue import SAMPLES, make_sample
from precompute.table.radiance import Skin, reflected_xyz, zero_order_reflectance

# A coarse table: its kernel has a standard deviation of 0.06 in (u, v).
COARSE = BakeRequest(delta_e=5, coherence_length_m=4e-6)
INDICES = (1.1, 1.56, 3.0)
# Degrees from the normal, mostly near the horizon, where Stam's form reflects too much; and azimuths. 60 directions.
ANGLES = (0, 15, 30, 45, 55, 65, 72, 78, 83, 86, 88, 89.5)
AZIMUTHS = (0, 37, 90, 180, 233)


def toward(theta_deg, azimuth_deg):
    theta, azimuth = np.radians(theta_deg), np.radians(azimuth_deg)
    return np.array([np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)])


def directional_albedo(table, wr, *, ior=1.56, stam=False, finer=1):
    """Y (a number) seen from wr (3,). By Gauss-Legendre over the polar angle and equal steps of a kernel around it:
    twice as many steps change the result by up to 2e-4 (test_the_quadrature_has_enough_steps)."""
    nodes, weights = np.polynomial.legendre.leggauss(math.ceil(finer * math.pi**2 / 4 / table.sigma_b))
    steps = math.ceil(finer * 2 * math.pi / table.sigma_b)
    azimuth = (np.arange(steps) + 0.5) * 2 * math.pi / steps
    theta = np.repeat((nodes + 1) * math.pi / 4, steps)
    solid_angle = np.repeat(weights * math.pi / 4, steps) * np.sin(theta) * 2 * math.pi / steps
    azimuth = np.tile(azimuth, len(nodes))
    wi = np.stack([np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)], axis=-1)
    scattering, form = without_mirror(table), {"skin": Skin(ior=ior), "stam": stam}
    xyz = reflected_xyz(scattering, wi, np.broadcast_to(wr, wi.shape), **form)
    mirrored = zero_order_reflectance(table, mirror_of(wr)[None], wr[None], **form)
    return float(solid_angle @ xyz[:, 1] + mirrored[0, 1])


@pytest.fixture(scope="module")
def tables():
    """A function that bakes a sample by name, once."""
    found = {}

    def of(name):
        if name not in found:
            found[name] = bake(prepare(make_sample(name)), COARSE)
        return found[name]

    return of


@pytest.mark.short("xenopeltis")
@pytest.mark.parametrize("name", SAMPLES)
def test_no_sample_reflects_more_than_arrives(tables, name):
    """The largest is 0.36, of Xenopeltis at an index of 3. The mirror image of light near the horizon is half below
    it."""
    table = tables(name)
    ways = [(theta, azimuth) for theta in ANGLES for azimuth in AZIMUTHS]
    for ior in INDICES:
        found = {way: directional_albedo(table, toward(*way), ior=ior) for way in ways}
        assert min(found.values()) > 0
        assert max(found.values()) <= 1, (ior, max(found, key=found.get))


def test_the_same_integral_finds_too_much_light_in_stams_form(tables):
    """At a mirror of the same matter it is at most 1; Stam's obliquity diverges towards the horizon."""
    grazing = toward(89.5, 0)
    assert directional_albedo(tables("xenopeltis"), grazing, ior=3.0, stam=True) > 1
    assert directional_albedo(tables("flat"), grazing, ior=3.0, stam=True) < 1


@pytest.mark.parametrize("ior", INDICES)
def test_along_the_normal_a_shallow_sample_reflects_as_its_matter_does(tables, ior):
    """A CD scatters its light over small angles, where Q is near Fresnel's reflectance: it sends back R of the light,
    or less by what its orders lose."""
    r = fresnel_reflectance(1.0, ior)
    assert directional_albedo(tables("flat"), toward(0, 0), ior=ior) == pytest.approx(r, rel=0.01)
    assert 0.9 * r < directional_albedo(tables("cd"), toward(0, 0), ior=ior) < 1.1 * r


def test_no_index_is_larger_than_that_of_the_approximation(tables):
    wr = toward(70, 37)
    held = directional_albedo(tables("blazed"), wr, ior=IOR_MAX)
    assert directional_albedo(tables("blazed"), wr, ior=10.0) == held


@pytest.mark.parametrize("way", [(0, 0), (65, 180), (89.5, 37)])
def test_the_quadrature_has_enough_steps(tables, way):
    table, wr = tables("xenopeltis"), toward(*way)
    for ior in INDICES:
        once, twice = (directional_albedo(table, wr, ior=ior, finer=finer) for finer in (1, 2))
        assert once == pytest.approx(twice, rel=5e-4)
