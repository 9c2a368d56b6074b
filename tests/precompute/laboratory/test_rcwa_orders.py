# SPDX-License-Identifier: GPL-3.0-or-later
"""The comparison of single orders with Maxwell's equations: factors for metals, Inkstone's convergence, the tables."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from laboratory.benchmarks import rcwa_orders
from laboratory.benchmarks.rcwa import Grating, fresnel, reflected
from laboratory.benchmarks.rcwa_orders_rows import (
    FACTORS,
    METALS,
    RATIO,
    Row,
    directions,
    off_by,
    reflectance,
    rigorous_orders,
    spectrum,
)
from precompute.optics.brdf import RATIO_IOR, fresnel_reflectance, half_angle_cosine, scattering_factor

pytestmark = pytest.mark.night("tests/precompute/optics/test_small_slope.py")

ABSENT = "the rigorous solver (inkstone) is in the environment py311-bpy45 only"
# Beyond 89 degrees the add-on clamps the cosine of a grazing view.
ANGLES = st.tuples(st.floats(0, 1.55), st.floats(0, 2 * np.pi))


def unit(theta, phi):
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


@given(ANGLES, ANGLES, st.floats(1.05, 3))
def test_at_a_real_index_the_factors_are_those_of_the_materials(light, view, ior):
    wi, wr = unit(*light), unit(*view)
    over = wi[2] * (wi[2] + wr[2]) ** 2
    assert FACTORS["small slope"](wi, wr, ior) == pytest.approx(scattering_factor(wi, wr, ior) / over, rel=1e-9)
    assert FACTORS["Stam"](wi, wr, ior) == pytest.approx(scattering_factor(wi, wr, ior, stam=True) / over, rel=1e-9)
    held = max(ior, RATIO_IOR)
    assert FACTORS[RATIO](wi, wr, held) == pytest.approx(FACTORS["small slope"](wi, wr, held), rel=1e-9)
    assert FACTORS["O = 1"](wi, wr, ior) == pytest.approx(fresnel_reflectance(half_angle_cosine(wi, wr), ior), rel=1e-9)


@pytest.mark.parametrize("metal", METALS)
def test_a_metal_has_fresnels_reflectance(metal):
    """The handbooks' reflectance at the normal, ((n - 1)^2 + k^2) / ((n + 1)^2 + k^2)."""
    n, k = METALS[metal].real, METALS[metal].imag
    assert reflectance(1.0, METALS[metal]) == pytest.approx(((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2))
    assert reflectance(0.3, METALS[metal]) == pytest.approx(fresnel(np.degrees(np.arccos(0.3)), METALS[metal]).mean())


@pytest.mark.parametrize("metal", METALS)
@pytest.mark.parametrize(("theta_deg", "azimuth_deg"), [(0, 0), (60, 0), (60, 45), (75, 90)])
def test_shallow_gratings_in_metal_have_the_orders_of_maxwells_equations(metal, theta_deg, azimuth_deg):
    """Within 1 %: the 32 parts of a period lower a first order by 0.3 %, and twice the 40 extra orders change one in TM
    light by 0.6 %."""
    pytest.importorskip("inkstone", reason=ABSENT)
    case = Grating("sinusoidal", 1.5, 0.003, theta_deg, azimuth_deg, METALS[metal])
    rigorous = rigorous_orders(case, 1, extra=40)
    for order in (-1, 0, 1):
        if (ways := directions(case, order)) is not None:
            wi, wr = ways
            expected = FACTORS["small slope"](wi, wr, case.index) * spectrum(case, order, wi[2] + wr[2])
            assert expected == pytest.approx(rigorous[order + 1], rel=1e-2)


def test_walls_in_metal_converge():
    """Inkstone's own matrices change this order by 13 % from 10 to 30 extra orders, the mean of TE and TM."""
    pytest.importorskip("inkstone", reason=ABSENT)
    case = Grating("binary", 1.5, 0.1, 60.0, index=METALS["aluminium"])
    usual, finer = rigorous_orders(case, 1), rigorous_orders(case, 1, extra=30)
    assert usual[0] == pytest.approx(finer[0], rel=0.02)


def test_the_plane_of_incidence_is_the_limit_of_directions_out_of_it():
    """Inkstone has other matrices for azimuth 0."""
    pytest.importorskip("inkstone", reason=ABSENT)
    within, beside = (reflected(Grating("blazed", 1.5, 0.25, 40.0, azimuth)) for azimuth in (0.0, 1e-3))
    assert within == pytest.approx(beside, abs=1e-6)


def test_an_order_that_scalar_theory_lacks_is_infinitely_off():
    rows = [Row(Grating("binary", 1.5, 0.1), 2, 50.0, 0.01, {"Stam": light}) for light in (0.02, 0.005, 0.0)]
    assert off_by(rows, "Stam").tolist() == [2, 2, np.inf]


def test_faint_orders_are_left_out():
    rows = [Row(Grating("binary", 1.5, 0.1), 1, 50.0, light, {}) for light in (2e-4, 0.5e-4)]
    assert rcwa_orders.kept(rows) == rows[:1]


@pytest.mark.usefixtures("matplotlib")
def test_the_quick_run_writes_tables_and_picture(tmp_path, capsys):
    pytest.importorskip("inkstone", reason=ABSENT)
    picture, facts = tmp_path / "a.png", tmp_path / "a.json"
    line = ["--quick", "--picture", str(picture), "--json", str(facts)]
    rcwa_orders.main(line)
    printed = capsys.readouterr().out
    for title in ("out of the plane", "gold, first orders", "depth to 0.25", "by depth", "twice the extra orders"):
        assert title in printed
    assert picture.stat().st_size > 1000
    totals = json.loads(facts.read_text())["totals"]
    assert max(one["rigorous"] for one in totals) < 1
