# SPDX-License-Identifier: GPL-3.0-or-later
"""Order efficiencies against the closed forms and against rigorous coupled waves (RCWA)."""

import json
import subprocess
import sys
from itertools import product

import numpy as np
import pytest

from devtools import ROOT
from laboratory.benchmarks import rcwa
from laboratory.study.efficiency import PROFILES, analytic_efficiency, efficiencies
from laboratory.verbs import PACKAGES
from precompute.base.failure import GratingError
from precompute.cli.parser import main
from precompute.optics.brdf import fresnel_reflectance, small_slope_reflectance

PERIOD = 2.5e-6
DEPTHS = (50e-9, 200e-9, 800e-9)
WAVELENGTHS = (450e-9, 550e-9, 650e-9)


def worst(kind, theta_i, samples, depths=DEPTHS):
    """Largest error over depths, wavelengths and orders -3 to 3."""
    return max(
        order.error
        for depth, lam in product(depths, WAVELENGTHS)
        for order in efficiencies(
            kind, period_m=PERIOD, depth_m=depth, wavelength_m=lam, theta_i=np.radians(theta_i), samples=samples
        )
    )


@pytest.mark.parametrize("theta_i", [0, 40, -75])
@pytest.mark.parametrize("kind", PROFILES)
def test_orders_are_those_of_the_closed_forms(kind, theta_i):
    """Binary: (pi m / N)^2 / 3 of an efficiency of at most (2 / (pi m))^2 is 3.2e-7 at N = 2048, for every m."""
    assert worst(kind, theta_i, 2048) <= (1e-13 if kind == "sinusoidal" else 3.3e-7)


@pytest.mark.parametrize("theta_i", [0, 40])
@pytest.mark.parametrize("kind", ["binary", "blazed"])
def test_errors_fall_as_the_square_of_the_samples(kind, theta_i):
    """The slope of log error over log N, 128 to 8192; the next term of the series is N^-4, 1e-3 of the error at 128."""
    samples = 2 ** np.arange(7, 14)
    errors = [worst(kind, theta_i, int(n), depths=(120e-9,)) for n in samples]
    assert np.polyfit(np.log(samples), np.log(errors), 1)[0] == pytest.approx(-2, abs=0.01)


@pytest.mark.night("test_orders_are_those_of_the_closed_forms")
@pytest.mark.parametrize("kind", PROFILES)
def test_the_closed_forms_hold_all_the_light(kind):
    """Orders -2000 to 2000 sum to 1; the tails of binary and blazed, 1 / m^2, leave at most 2 (2 / pi)^2 / 4000."""
    total = sum(analytic_efficiency(kind, m, 0.7) for m in range(-2000, 2001))
    assert total == pytest.approx(1, abs=1e-12 if kind == "sinusoidal" else 2.1e-4)


def test_only_real_orders_are_given():
    """550 nm on 1 um at 30 degrees: m = -2 leaves at sin = -0.6, m = 1 would leave at sin = 1.05."""
    found = efficiencies("blazed", period_m=1e-6, depth_m=100e-9, wavelength_m=550e-9, theta_i=np.radians(30))
    orders = [o.order for o in found]
    assert orders == [-2, -1, 0]


def test_a_blaze_sends_light_down_its_slope():
    """A facet half a wavelength high at normal incidence has nearly all light in m = -1."""
    orders = efficiencies("blazed", period_m=50e-6, depth_m=275e-9, wavelength_m=550e-9)
    assert max(orders, key=lambda o: o.computed).order == -1
    assert {o.order: o for o in orders}[-1].computed > 0.999


def test_the_verb(capsys):
    """For binary grooves, m = 0 has cos(phi / 2)^2 at w = 2."""
    arguments = ["efficiency", "binary", "--period-um", "2.5", "--depth-nm", "100", "--wavelength-nm", "550"]
    assert main([*arguments, "--json", "-"], PACKAGES) == 0
    orders = json.loads(capsys.readouterr().out)["orders"]
    assert [o["order"] for o in orders] == list(range(-3, 4))
    assert orders[3]["analytic"] == pytest.approx(np.cos(2 * np.pi * 100 / 550) ** 2)
    assert max(o["error"] for o in orders) <= 1e-6
    assert main([*arguments, "--theta-i", "40", "--orders", "1"], PACKAGES) == 0
    assert capsys.readouterr().out.startswith(" -1  computed")


def light(capsys, *arguments):
    """The facts of `efficiency` at a wavelength of 500 nm."""
    assert main(["efficiency", *arguments, "--wavelength-nm", "500", "--json", "-"], PACKAGES) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("theta_deg", [0, 40, -80])
@pytest.mark.parametrize("ior", [1, 1.56, 3])
def test_a_flat_surface_reflects_by_fresnels_equations(capsys, theta_deg, ior):
    options = ("--depth-nm", "0", "--theta-i", str(theta_deg), "--ior", str(ior))
    facts = light(capsys, "binary", "--period-um", "2", *options)
    expected = fresnel_reflectance(np.cos(np.radians(theta_deg)), ior)
    assert facts["reflected_total"] == pytest.approx(expected, abs=1e-12)
    assert {o["order"]: o["reflected"] for o in facts["orders"]}[0] == pytest.approx(expected, abs=1e-12)


def test_the_light_of_a_shallow_sinusoid_is_that_of_rices_solution(capsys):
    """(2 pi A)^2 4 cos ti cos tr Q for an amplitude of A wavelengths: half of A to each side, and the next term of the
    series is (pi w A)^2 = 1.5e-4 of an order at A = 0.002 and w = 1.7 to 2."""
    facts = light(capsys, "sinusoidal", "--period-um", "1", "--depth-nm", "2", "--ior", "2")
    wi, wr = np.array([0, 0, 1.0]), np.array([0.5, 0, np.sqrt(0.75)])
    expected = (np.pi * 0.002) ** 2 * 4 * wr[2] * small_slope_reflectance(wi, wr, 2)
    assert {o["order"]: o["reflected"] for o in facts["orders"]}[1] == pytest.approx(expected, rel=1.5e-4)


def test_the_total_has_the_orders_that_are_not_printed(capsys):
    """Of 16 samples too: the total takes at least 16 to an order."""
    grating = ("blazed", "--period-um", "4", "--depth-nm", "150", "--theta-i", "30")
    every, few = light(capsys, *grating, "--orders", "12"), light(capsys, *grating, "--orders", "1")
    assert every["reflected_total"] == few["reflected_total"]
    assert every["reflected_total"] == pytest.approx(sum(o["reflected"] for o in every["orders"]), rel=1e-12)
    assert sum(o["reflected"] for o in few["orders"]) < every["reflected_total"]
    rough = light(capsys, *grating, "--orders", "1", "--samples", "16")
    assert rough["reflected_total"] == pytest.approx(every["reflected_total"], rel=1e-3)


def test_a_total_of_thousands_of_orders_is_unknown(capsys):
    grating = ("binary", "--period-um", "600", "--depth-nm", "100")
    assert light(capsys, *grating)["reflected_total"] is None
    assert main(["efficiency", *grating, "--wavelength-nm", "500"], PACKAGES) == 0
    assert "unknown: more than 1000 orders" in capsys.readouterr().out


def test_dev_finds_the_laboratorys_verbs():
    line = [sys.executable, ROOT / "dev", "grating", "efficiency", "--help"]
    assert "--theta-i" in subprocess.run(line, capture_output=True, text=True, check=True).stdout


@pytest.mark.parametrize(
    "changed",
    [
        {"period_m": 0.0},
        {"wavelength_m": -1.0},
        {"depth_m": -1e-9},
        {"depth_m": float("nan")},
        {"theta_i": np.pi / 2},
        {"samples": 7},
        {"samples": 33},
        {"orders": -1},
        {"kind": "flat"},
    ],
)
def test_what_cannot_be_is_refused(changed):
    given = {"kind": "binary", "period_m": PERIOD, "depth_m": 1e-7, "wavelength_m": 5e-7} | changed
    with pytest.raises(GratingError):
        efficiencies(**given)


RCWA_ABSENT = "the rigorous solver (inkstone) is in the environment py311-bpy45 only"


@pytest.mark.parametrize("theta_deg", [0.0, 60.0])
def test_the_rigorous_solver_knows_a_flat_surface(theta_deg):
    """Fresnel's equations, TE and TM, without loss."""
    pytest.importorskip("inkstone", reason=RCWA_ABSENT)
    powers = rcwa.reflected(rcwa.Grating("binary", 3.5, 1e-9, theta_deg))
    assert powers[:, :-1].sum(axis=1) == pytest.approx(rcwa.fresnel(theta_deg), abs=1e-9)
    assert powers.sum(axis=1) == pytest.approx(1, abs=1e-9)


@pytest.mark.night("test_orders_are_those_of_the_closed_forms")
@pytest.mark.parametrize("kind", PROFILES)
def test_scalar_theory_holds_where_the_relief_is_shallow_and_long(kind):
    """At a wall scalar theory is wrong over a strip as wide as the relief is deep, and a period has two walls. A finer
    RCWA changes an order by at most 5e-4; energy is conserved to rounding."""
    pytest.importorskip("inkstone", reason=RCWA_ABSENT)
    for depth in (0.02, 0.1):
        grating = rcwa.Grating(kind, 10.5, depth)
        assert rcwa.compare(grating).difference <= 2 * depth / grating.period + 5e-4
        assert rcwa.reflected(grating).sum(axis=1) == pytest.approx(1, abs=1e-10)


def test_what_walls_add_falls_as_the_period_grows():
    """The error falls with the share of the walls in a period, apart from higher powers of that share: the slope is
    -0.91 instead of -1."""
    pytest.importorskip("inkstone", reason=RCWA_ABSENT)
    periods = (3.5, 5.5, 10.5, 20.5)
    found = [rcwa.compare(rcwa.Grating("binary", period, 0.05)).difference for period in periods]
    assert np.polyfit(np.log(periods), np.log(found), 1)[0] == pytest.approx(-1, abs=0.15)


@pytest.mark.parametrize("theta_deg", [0.0, 40.0])
@pytest.mark.parametrize("kind", PROFILES)
def test_scalar_theory_fails_where_the_relief_is_deep_and_short(kind, theta_deg):
    """More than 5 % of the reflected light is in another order; RCWA itself is exact to 0.2 %."""
    pytest.importorskip("inkstone", reason=RCWA_ABSENT)
    assert rcwa.compare(rcwa.Grating(kind, 1.5, 0.25, theta_deg)).difference > 0.05


def test_the_boundary_is_the_last_period_within():
    rows = [rcwa.Row(rcwa.Grating("binary", p, 0.1), d, 1.0) for p, d in ((1, 0.01), (2, 0.06), (5, 0.02), (9, 0.01))]
    assert [rcwa.smallest_period(rows, one) for one in (0.001, 0.01, 0.02, 0.05, 0.1)] == [None, 9, 5, 5, 1]
    assert "5% from period 5" in rcwa.boundary(rows)
