# SPDX-License-Identifier: GPL-3.0-or-later
"""The evaluation: peaks in closed form, the period of a blaze, the colours of a bake, the command."""

import json
import sys
from importlib.machinery import PathFinder
from unittest.mock import MagicMock

import numpy as np
import pytest

from laboratory.study import evaluation
from laboratory.study.colour_comparison import compare_bake, dominant_wavelength
from laboratory.study.evaluation import evaluate_method, peak
from laboratory.study.response import (
    ANGLE_STEP,
    WINDOW,
    FirstOrder,
    Plane,
    first_order_angle,
    first_order_plane,
    response,
)
from laboratory.verbs import PACKAGES
from laboratory.verbs.evaluate_verb import evaluation_settings
from precompute.base.failure import GratingError
from precompute.cli.parser import build_parser, main
from precompute.colour.observer import observer, wavelengths, white_xyz
from precompute.methods import baked
from precompute.methods.baked import Baked
from precompute.methods.method import Method, Settings
from precompute.methods.method_registry import METHODS
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare
from precompute.surface.samples.ruled_gratings import blazed
from precompute.table.table import Table

THETA_I = np.radians(75)


@pytest.fixture(scope="module")
def blaze():
    """The blazed sample with fewer rows; all rows are equal."""
    return prepare(blazed(rows=26))


def test_the_peak_of_a_gaussian_is_exact():
    x = np.cumsum(np.random.default_rng(1).uniform(0.5, 1.5, 40))
    for centre in (x[11] + 0.1, x[20], x[30] - 0.3):
        values = 7e-5 * np.exp(-((x - centre) ** 2) / 18)
        assert peak(x, values) == pytest.approx(centre, abs=1e-9)
        assert peak(-x, values) == pytest.approx(-centre, abs=1e-9)


def test_a_peak_without_neighbours_is_its_sample():
    x = np.arange(5.0)
    assert peak(x, np.array([0, 0, 2, 0, 0])) == 2
    assert peak(x, np.array([0, 1, 2, 0, 0])) == 2
    assert peak(x, np.array([3, 1, 2, 0, 0])) == 0
    assert peak(x, np.array([0, 1, 1, 1, 0.5])) == 1
    assert np.isnan(peak(x, np.zeros(5)))


def test_views_are_the_thesis_s():
    lambdas = wavelengths(5e-9)
    angles = first_order_angle(THETA_I, lambdas, 2.5e-6)
    assert np.degrees(angles[[0, -1]]) == pytest.approx([-54.5, -40.8], abs=0.05)
    plane = Plane(THETA_I, angles)
    assert plane.u == pytest.approx(-lambdas / 2.5e-6)
    assert plane.w == pytest.approx(np.cos(THETA_I) + np.cos(angles))
    with pytest.raises(GratingError, match="no first order"):
        first_order_angle(THETA_I, lambdas, 0.3e-6)


def test_no_view_is_an_expected_angle():
    lambdas = wavelengths(5e-9)
    for period in (2.5e-6, 1144e-9, 1552e-9):
        plane = first_order_plane(THETA_I, lambdas, period)
        gap = np.abs(plane.theta_v[:, None] - first_order_angle(THETA_I, lambdas, period)).min(axis=0)
        assert gap.min() > 1e-9
        assert np.median(gap) > 0.1 * ANGLE_STEP


@pytest.mark.parametrize("periodic", [True, False])
@pytest.mark.parametrize("name", ["reference", "reference-patch"])
def test_the_quick_way_to_a_reference_is_the_reference(name, periodic):
    rng = np.random.default_rng(4)
    height = 250e-9 * rng.random((24, 30))
    relief = prepare(HeightMap(height, (80e-9, 80e-9), "test", periodic=periodic))
    method = METHODS[name](relief, Settings(coherence_length_m=3e-6))
    plane = Plane(THETA_I, np.radians(np.linspace(-80, 60, 9)))
    lambdas = np.array([390e-9, 610e-9])
    direct = np.stack([method.density(plane.u, np.zeros(9), plane.w, wavelength_m=lam) for lam in lambdas])
    # The bins' kernel ends at 5.5 sigma in `response`, at 7 in `density`: 3e-7.
    assert np.abs(response(method, plane, lambdas) - direct).max() <= 1e-6 * direct.max()


def test_the_period_of_a_blaze(blaze):
    """With 21 wavelengths and half as many views."""
    lambdas = wavelengths(20e-9)
    settings = evaluation.thesis_settings()
    first_order = FirstOrder(THETA_I, 2.5e-6, lambdas, np.radians(0.04))
    found = {
        name: evaluate_method(name, blaze, settings, first_order=first_order)
        for name in ("reference", "reference-patch", "flss", "chebyshev", "nmm", "pq")
    }
    told = {name: one.as_dict() for name, one in found.items()}
    truth = told["reference-patch"]["period_mean_nm"]
    assert 2499.3 <= truth <= 2499.98
    for name in ("reference", "flss", "chebyshev", "nmm"):
        assert told[name]["period_mean_nm"] == pytest.approx(truth, abs=0.1)
        assert told[name]["period_mean_nm"] == pytest.approx(2500, abs=1)
        assert told[name]["period_variance_nm"] <= 0.377
        assert told[name]["peak_angle_rms_deg"] <= 0.02
    assert told["pq"]["period_mean_nm"] == pytest.approx(2500, abs=3)
    off = found["flss"].peak_angles - first_order_angle(THETA_I, lambdas, 2.5e-6)
    assert np.degrees(np.sqrt(np.mean(off**2))) <= 0.02


def test_a_wrong_surface_is_seen(blaze):
    flss = METHODS["flss"](blaze, evaluation.thesis_settings())

    class Off(Method):
        def density(self, u, v, w, *, wavelength_m):
            return flss.density(u * 1.001, v, w, wavelength_m=wavelength_m)

    lambdas = wavelengths(50e-9)
    plane = first_order_plane(THETA_I, lambdas, 2.5e-6)
    rows = response(Off(), plane, lambdas)
    inside = np.abs(np.abs(plane.u) * 2.5e-6 / lambdas[:, None] - 1) < WINDOW
    periods = [lam / abs(peak(plane.u[at], row[at])) for lam, at, row in zip(lambdas, inside, rows, strict=True)]
    assert np.mean(periods) == pytest.approx(2499.58e-9 * 1.001, rel=1e-5)


def test_turning_brings_the_light_to_its_side():
    height = np.zeros((4, 6))
    marked = {0: (1, 5), 90: (0, 2), 180: (1, 0), 270: (3, 2)}  # the pixel on the light's side, row 0 at the top
    for azimuth, place in marked.items():
        one = height.copy()
        one[place] = 1
        turned = evaluation.turned(HeightMap(one, (2e-9, 3e-9), "test"), azimuth)
        assert turned.height_m[:, 0].any()
        assert turned.pixel_size_m == ((2e-9, 3e-9) if azimuth % 180 == 0 else (3e-9, 2e-9))


def test_dominant_wavelengths():
    lambdas = np.array([430e-9, 480e-9, 520e-9, 580e-9, 640e-9])
    assert dominant_wavelength(observer(lambdas, "E")) == pytest.approx(lambdas, abs=0.01e-9)
    mixed = 0.3 * observer(lambdas, "E") / observer(lambdas, "E").sum(axis=1, keepdims=True) + 0.7 * white_xyz()
    assert dominant_wavelength(mixed) == pytest.approx(lambdas, abs=0.01e-9)
    purple = observer(np.array([430e-9, 650e-9]), "E")
    assert np.isnan(dominant_wavelength(purple.sum(axis=0)[None]))[0]


def test_dominant_wavelength_is_colour_science_s():
    pytest.importorskip("scipy.spatial", reason="colour-science's dominant wavelength needs SciPy")
    colour = pytest.importorskip("colour")
    xyz = np.array([[0.3, 0.2, 0.1], [0.2, 0.4, 0.3], [0.4, 0.4, 0.1]])
    white = white_xyz()[:2] / white_xyz().sum()
    for one in xyz:
        expected = colour.dominant_wavelength(one[:2] / one.sum(), white)[0]
        got = dominant_wavelength(one[None])[0] * 1e9
        if expected > 0:
            assert got == pytest.approx(expected, abs=0.5)


@pytest.mark.night("test_the_period_of_a_blaze")
def test_a_bake_s_colours_are_compared(blaze, monkeypatch):
    """A black stand-in table has the greatest possible error."""
    settings = Settings(coherence_length_m=10e-6)
    sigma = METHODS["reference"](blaze, settings).sigma_b
    dark = Table(np.zeros((2, 256, 256, 3), np.float32), np.zeros((4, 3)), sigma, 4 / 252, "D65")
    monkeypatch.setattr(baked, "build", lambda relief, settings: Baked(dark, settings))
    found = compare_bake(blaze, settings, FirstOrder(THETA_I, 2.5e-6)).as_dict()
    assert found["relative_dy"] == pytest.approx(1)
    assert found["period_mean_nm"] is None
    assert found["peak_angle_deg"] is None
    assert -55 < found["reference_peak_angle_deg"] < -40


def test_the_command(tmp_path, capsys, matplotlib):
    plot = tmp_path / "made" / "plot.png"
    arguments = ["evaluate", "sample:blazed", "--methods", "chebyshev,stam", "--period-nm", "2500"]
    assert (
        main([*arguments, "--json", str(tmp_path / "out.json"), "-o", str(plot), "--progress", "none"], PACKAGES) == 0
    )
    facts = json.loads((tmp_path / "out.json").read_text())
    assert list(facts["methods"]) == ["chebyshev", "stam"]
    for one in facts["methods"].values():
        assert set(one) == {"period_mean_nm", "period_variance_nm", "peak_angle_rms_deg", "seconds"}
        assert one["period_mean_nm"] == pytest.approx(2500, abs=1)
    assert facts["angles_against"] == "--period-nm"
    assert facts["files"] == [str(plot)]
    assert plot.stat().st_size > 5000
    assert list(plot.parent.iterdir()) == [plot]
    assert "chebyshev" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (["sample:flat", "--methods", "flss"], "sample:flat: the relief has no period"),
        (["sample:blazed", "--methods", "gem"], "no spectrum"),
        (["sample:blazed", "-o", "x.pdf"], "not a PNG"),
        (["sample:bluray", "--methods", "stam"], "no first order"),
    ],
)
def test_refusals_are_one_line(arguments, fault, capsys):
    assert main(["evaluate", *arguments], PACKAGES) == 1
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith("error: ") and fault in line


def test_light_below_the_surface_is_refused(capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["evaluate", "sample:blazed", "--theta-i", "95"], PACKAGES)
    assert "--theta-i: '95': give a number from 0 to 89.99" in capsys.readouterr().err


def test_without_matplotlib_the_remedy_is_named(monkeypatch, capsys, tmp_path):
    """Also if colour-science has put a stand-in in the place of matplotlib."""
    monkeypatch.setattr(PathFinder, "find_spec", lambda name: None)
    monkeypatch.setitem(sys.modules, "matplotlib", MagicMock())
    assert main(["evaluate", "sample:blazed", "--methods", "stam", "-o", str(tmp_path / "x.png")], PACKAGES) == 1
    assert "pip install matplotlib" in capsys.readouterr().err


@pytest.mark.parametrize(("given", "of_bake", "of_others"), [
    ((), None, 65e-6), (("--coherence-um", "65"), 65e-6, 65e-6), (("--coherence-um", "40"), 40e-6, 40e-6),
    (("--coherence-um", "auto"), None, None),
])  # fmt: skip
def test_a_length_that_is_given_is_not_the_default(given, of_bake, of_others):
    """Without --coherence-um a bake chooses its own length. A given 65 um is used like any other length."""
    arguments = build_parser(["evaluate"], PACKAGES).parse_args(["evaluate", "sample:blazed", *given])
    for name, length_m in (("bake", of_bake), ("flss", of_others), ("stam", of_others)):
        found = evaluation_settings(arguments, name, 2.5e-6).coherence_length_m
        assert found == length_m if length_m is None else found == pytest.approx(length_m, rel=1e-12)
