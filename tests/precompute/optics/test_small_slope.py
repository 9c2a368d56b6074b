# SPDX-License-Identifier: GPL-3.0-or-later
"""The small slope approximation against closed forms: Fresnel at the mirror, reciprocity, the perturbation series."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from laboratory.benchmarks.rcwa import Grating
from laboratory.benchmarks.rcwa_orders_rows import FACTORS, directions, rigorous_orders, spectrum
from precompute.optics.brdf import fresnel_reflectance, small_slope_reflectance

ANGLES = st.tuples(st.floats(0, np.pi / 2), st.floats(0, 2 * np.pi))
INDICES = st.floats(1.05, 3)


def unit(theta, phi):
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


@given(ANGLES, INDICES)
def test_at_the_mirror_it_is_fresnel(light, ior):
    wi = unit(*light)
    # Both sum four terms of up to 1 in double precision.
    assert small_slope_reflectance(wi, wi * (-1, -1, 1), ior) == pytest.approx(
        fresnel_reflectance(wi[2], ior), abs=1e-12
    )


@given(ANGLES, ANGLES, INDICES)
def test_it_is_reciprocal(light, view, ior):
    wi, wr = unit(*light), unit(*view)
    assert small_slope_reflectance(wi, wr, ior) == pytest.approx(small_slope_reflectance(wr, wi, ior), rel=1e-12)


@given(ANGLES, ANGLES, st.floats(0, 2 * np.pi), INDICES)
def test_only_the_azimuth_between_the_directions_counts(light, view, turn, ior):
    (ti, pi), (tr, pr) = light, view
    turned = small_slope_reflectance(unit(ti, pi + turn), unit(tr, pr + turn), ior)
    # Near the normal the azimuth is known to 1e-16 over the sines, whose product is held at 1e-12.
    assert turned == pytest.approx(small_slope_reflectance(unit(ti, pi), unit(tr, pr), ior), rel=1e-6)


@pytest.mark.parametrize("ior", [1.1, 1.56, 3.0])
@pytest.mark.parametrize("azimuth_deg", [0, 37, 90, 180])
def test_it_is_the_first_order_perturbation(ior, azimuth_deg):
    """Rice's amplitudes of TE and TM (Ulaby and Elachi 1990, Radar Polarimetry, 4.3), each by itself."""
    ti, tr, azimuth = 0.9, 0.5, np.radians(azimuth_deg)
    e, ci, cr, si, sr = ior**2, np.cos(ti), np.cos(tr), np.sin(ti), np.sin(tr)
    a, b = np.sqrt(e - si**2), np.sqrt(e - sr**2)
    # The azimuth of the scattered ray against the incident ray's propagation, which leads away from the light.
    c, s = np.cos(azimuth + np.pi), np.sin(azimuth + np.pi)
    hh = (e - 1) * c / ((ci + a) * (cr + b))
    vh = (e - 1) * s * b / ((ci + a) * (e * cr + b))
    hv = (e - 1) * s * a / ((e * ci + a) * (cr + b))
    vv = (e - 1) * (e * si * sr - a * b * c) / ((e * ci + a) * (e * cr + b))
    expected = (hh**2 + vh**2 + hv**2 + vv**2) / 2
    assert small_slope_reflectance(unit(ti, 0), unit(tr, azimuth), ior) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("theta_deg", "azimuth_deg"), [(0, 0), (60, 0), (80, 0), (60, 45), (75, 90)])
def test_shallow_gratings_have_the_orders_of_maxwells_equations(theta_deg, azimuth_deg):
    pytest.importorskip("inkstone", reason="only the environment of the benchmarks has the solver")
    case = Grating("binary", 1.5, 0.003, theta_deg, azimuth_deg)
    rigorous = rigorous_orders(case, 1, extra=60)
    for order in (-1, 0, 1):
        if (ways := directions(case, order)) is not None:
            wi, wr = ways
            expected = FACTORS["small slope"](wi, wr, case.index) * spectrum(case, order, wi[2] + wr[2])
            # The next term of the perturbation series is about (2 pi depth)^2 / 2 = 2e-4 of an order. A binary profile
            # needs no steps.
            assert expected == pytest.approx(rigorous[order + 1], rel=1e-3)
