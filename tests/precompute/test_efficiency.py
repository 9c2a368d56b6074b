# SPDX-License-Identifier: GPL-3.0-or-later
"""Order efficiencies against the closed forms (issue 3, must show 1)."""

import json
from itertools import product

import numpy as np
import pytest

from precompute.cli import main
from precompute.efficiency import PROFILES, analytic_efficiency, efficiencies
from precompute.failure import GratingError

PERIOD = 2.5e-6
DEPTHS = (50e-9, 200e-9, 800e-9)
WAVELENGTHS = (450e-9, 550e-9, 650e-9)


def worst(kind, theta_i, samples, depths=DEPTHS):
    """Largest error over depths, wavelengths and orders -3 to 3."""
    return max(
        order.error
        for depth, lam in product(depths, WAVELENGTHS)
        for order in efficiencies(kind, PERIOD, depth, lam, np.radians(theta_i), samples=samples)
    )


@pytest.mark.parametrize("theta_i", [0, 40, -75])
@pytest.mark.parametrize("kind", PROFILES)
def test_orders_are_those_of_the_closed_forms(kind, theta_i):
    """Binary: (pi m / N)^2 / 3 of an efficiency of at most (2 / (pi m))^2 is 3.2e-7 at N = 2048, whatever m."""
    assert worst(kind, theta_i, 2048) <= (1e-13 if kind == "sinusoidal" else 3.3e-7)


@pytest.mark.parametrize("theta_i", [0, 40])
@pytest.mark.parametrize("kind", ["binary", "blazed"])
def test_errors_fall_as_the_square_of_the_samples(kind, theta_i):
    """The slope of log error over log N, 128 to 8192; the next term of the series is N^-4, 1e-3 of it at 128."""
    samples = 2 ** np.arange(7, 14)
    errors = [worst(kind, theta_i, int(n), depths=(120e-9,)) for n in samples]
    assert np.polyfit(np.log(samples), np.log(errors), 1)[0] == pytest.approx(-2, abs=0.01)


@pytest.mark.parametrize("kind", PROFILES)
def test_the_closed_forms_hold_all_the_light(kind):
    """Orders -2000 to 2000 sum to 1; the tails of binary and blazed, 1 / m^2, leave at most 2 (2 / pi)^2 / 4000."""
    total = sum(analytic_efficiency(kind, m, 0.7) for m in range(-2000, 2001))
    assert total == pytest.approx(1, abs=1e-12 if kind == "sinusoidal" else 2.1e-4)


def test_only_real_orders_are_given():
    """550 nm on 1 um at 30 degrees: m = -2 leaves at sin = -0.6, m = 1 would leave at sin = 1.05."""
    orders = [o.order for o in efficiencies("blazed", 1e-6, 100e-9, 550e-9, np.radians(30))]
    assert orders == [-2, -1, 0]


def test_a_blaze_sends_light_down_its_slope():
    """A facet half a wavelength high, light at the normal: the path is one wavelength and m = -1 has nearly all."""
    orders = efficiencies("blazed", 50e-6, 275e-9, 550e-9)
    assert max(orders, key=lambda o: o.computed).order == -1
    assert {o.order: o for o in orders}[-1].computed > 0.999


def test_the_verb(capsys):
    """One of binary's grooves: cos^2, (2 / pi)^2 sin^2 at w = 2 for m = 0."""
    arguments = ["efficiency", "binary", "--period-um", "2.5", "--depth-nm", "100", "--wavelength-nm", "550"]
    assert main([*arguments, "--json", "-"]) == 0
    orders = json.loads(capsys.readouterr().out)["orders"]
    assert [o["order"] for o in orders] == list(range(-3, 4))
    assert orders[3]["analytic"] == pytest.approx(np.cos(2 * np.pi * 100 / 550) ** 2)
    assert max(o["error"] for o in orders) <= 1e-6
    assert main([*arguments, "--theta-i", "40", "--orders", "1"]) == 0
    assert capsys.readouterr().out.startswith(" -1  computed")


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
