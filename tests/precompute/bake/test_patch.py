# SPDX-License-Identifier: GPL-3.0-or-later
"""The patch model's bake against the patch model's reference."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from precompute.bake import ensemble, patch
from precompute.bake.make import make
from precompute.bake.needs import Needs
from precompute.bake.patch import W_MIN, patch_series
from precompute.bake.request import BakeRequest
from precompute.base.failure import GratingError
from precompute.cli import parser
from precompute.cli.bake_verb import read_request
from precompute.maths.chebyshev import bessel_j
from precompute.methods.exact import Patch
from precompute.methods.method import Settings
from precompute.methods.method_registry import METHODS
from precompute.optics.region import Region
from precompute.reference.reference import PatchReference, blurred
from precompute.reflectance.matter import MIRROR, Matter
from precompute.spectra.spectrum import PatchWindow, window_at
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare

PIXEL = 80e-9
NEEDS = Needs(Region((-0.6, 0.6), (-0.6, 0.6)), w=(1.0, 2.0))


def skin():
    """An irregular relief over 4.8 x 5.8 um."""
    rng = np.random.default_rng(3)
    y, x = np.arange(60)[:, None] / 60, np.arange(72) / 72
    waves = sum(np.cos(2 * np.pi * (m * x + n * y) + rng.uniform(0, 6)) for m, n in [(1, 1), (0, 2), (4, -1)])
    return prepare(HeightMap(50e-9 * waves, (PIXEL, PIXEL), "test", periodic=True))


RELIEF = skin()
LENGTH_M = RELIEF.size_m[1]


@pytest.mark.parametrize(("w", "lam"), [(1.9, 400e-9), (1.2, 550e-9), (0.5, 700e-9)])
def test_the_bins_add_up_to_the_reference(w, lam):
    """Sums of Gaussians at the bins give |P|^2. Along each axis, 6e-5 of the peak's 2e-3 folds back. The window is cut
    where it has fallen to 3e-4 of its amplitude, and there the amplitude is under a tenth of the peak's. Measured:
    2e-4."""
    window = PatchWindow(RELIEF, LENGTH_M / 4)
    series = patch_series(window, 0.6)
    u, v = np.random.default_rng(0).uniform(-0.55, 0.55, (2, 200))
    truth = Patch(window, Settings()).density(u, v, w, wavelength_m=lam)
    power = series.mixed(series.weights(np.array([w / lam])) * (w / lam) ** 2, (slice(None), slice(None)))[:, 0]
    got = blurred(power, series.grid, (u, v), lam=lam, sigma_b=series.kernel_left(series.sigma_b, lam)[0])
    assert np.abs(got - truth).max() <= 5e-4 * truth.max()
    assert np.median(np.abs(got - truth) / truth) <= 2e-3


def test_the_table_keeps_the_asked_colours():
    made = make([RELIEF], BakeRequest(coherence_length_m=LENGTH_M, needs=NEEDS, model="patch"))
    assert made.errors.p99 <= 1
    assert made.sample_set is None
    # Again in an independent way: the method by its name, at directions drawn here.
    rng = np.random.default_rng(5)
    u, v = rng.uniform(-0.5, 0.5, (2, 40))
    reference = METHODS["reference-patch"](RELIEF, Settings(coherence_length_m=LENGTH_M))
    truth = reference.xyz(u, v, 1.5)
    got = made.table.scattered_over_w2(u, v, 1.5) * 1.5**2
    assert np.abs(got - truth).max() <= 0.01 * truth.max()
    assert not made.table.zero_order_xyz(np.array([1.0])).any()


def two_gratings():
    """16 x 4 um: on the left cosines of 50 nm amplitude and a period of 0.8 um along x, on the right of 1 um."""
    pixels = np.arange(200)
    waves = 50e-9 * np.cos(2 * np.pi * pixels * PIXEL / np.where(pixels < 100, 0.8e-6, 1e-6))
    return HeightMap(np.tile(waves, (50, 1)), (PIXEL, PIXEL), "two", periodic=True)


@pytest.mark.parametrize(("x", "period_m"), [(4.0, 0.8e-6), (12.0, 1e-6)])
def test_a_window_elsewhere_shows_the_first_order_of_what_is_there(x, period_m):
    """In closed form: the window's transform has the peak 4 pi sigma^2 / lambda^2, of which the first order of a cosine
    has the share J_1(2 pi s a)^2. The other grating begins at 4 sigma, where the window has fallen to 3e-4, and so much
    of it is at most 2e-3 of this light. The bake may add a dE00 of 1, under 3 % of the light."""
    lam, w = 532e-9, 1.6
    needs = Needs(Region((0.45, 0.75), (-0.1, 0.1)), w=(1.4, 1.8))
    relief, request = prepare(two_gratings()), BakeRequest(0.5, 4e-6, "532nm", needs=needs, model="patch")
    table = make([relief], replace(request, patch_um=(x, 2.0))).table
    assert table.w_range == (1.4, 1.8)
    closed = 4 * np.pi * 1e-12 / lam**2 * bessel_j(2 * np.pi * w / lam * 50e-9, 2)[1] ** 2
    other_m = 1.8e-6 - period_m
    u, v = np.array([lam / period_m, lam / other_m]), np.zeros(2)
    exact = PatchReference(window_at(relief, 1e-6, (x, 2.0))).density(u, v, w, wavelength_m=lam)
    assert exact[0] == pytest.approx(closed, rel=5e-3)
    baked = table.scattered_over_w2(u, v, w)[:, 1] * w**2
    assert baked == pytest.approx(exact, rel=0.03, abs=0.01 * closed)


def test_a_place_is_counted_from_the_lower_left_corner():
    """A bump in the third row from the top and the sixth column is in the middle of the window about it."""
    height = np.zeros((30, 40))
    height[2, 5] = 1e-8
    relief = prepare(HeightMap(height, (PIXEL, 0.5 * PIXEL), "bump", periodic=True))
    found = window_at(relief, 1e-7, (5.5 * 0.04, 27.5 * 0.08)).relief
    assert np.unravel_index(found.height_m.argmax(), found.height_m.shape) == (15, 20)
    assert window_at(relief, 1e-7).relief is relief


@pytest.mark.parametrize(("centre", "coherence_m", "told"), [
    ((1.9, 3.0), 4e-6, "no window of 4 um about 1.9,3 um fits on the scan of 5.76 x 4.8 um; give a --patch-um from 2,2 "
     "to 3.76,2.8"),
    ((3.0, 2.9), 4e-6, "about 3,2.9 um"),
    ((2.88, 2.4), 5e-6, "about 2.88,2.4 um fits on the scan of 5.76 x 4.8 um; ask for a --coherence-um of at most 4.8"),
])  # fmt: skip
def test_a_window_over_the_edge_is_refused(centre, coherence_m, told):
    relief = replace(RELIEF, periodic=False)
    with pytest.raises(GratingError) as caught:
        patch.plan([relief], BakeRequest(coherence_length_m=coherence_m, model="patch", patch_um=centre))
    assert told in str(caught.value)


def test_where_edges_wrap_only_the_centre_must_be_on_the_scan():
    assert window_at(RELIEF, LENGTH_M, (0.0, 4.8)).relief.periodic
    with pytest.raises(GratingError, match="from 0,0 to 5.76,4.8"):
        window_at(RELIEF, LENGTH_M, (0.0, 4.9))


def test_the_ensemble_model_has_no_place():
    with pytest.raises(
        GratingError, match="averages over all places .*; choose --model patch, or leave --patch-um out"
    ):
        ensemble.plan([RELIEF], BakeRequest(patch_um=(1.0, 1.0)))


def test_a_table_begins_where_polynomials_can_follow():
    plan = patch.plan(
        [RELIEF], BakeRequest(delta_e=4.0, coherence_length_m=LENGTH_M, needs=Needs(Region((-0.1, 0.1), (-0.1, 0.1))))
    )
    assert plan.w_range == (W_MIN, 2.0)


def test_several_scans_are_refused():
    with pytest.raises(GratingError, match="2 scans: the patch model takes one"):
        patch.plan([RELIEF, RELIEF], BakeRequest(coherence_length_m=LENGTH_M))


def test_a_spread_of_directions_is_refused():
    with pytest.raises(GratingError, match="one direction; choose --model ensemble, or leave --spread-deg out"):
        patch.plan([RELIEF], BakeRequest(coherence_length_m=LENGTH_M, spread_deg=2.0))


def test_a_metal_is_refused(tmp_path, capsys):
    with pytest.raises(GratingError, match="the patch model takes only a dielectric; choose "):
        patch.plan([RELIEF], BakeRequest(coherence_length_m=LENGTH_M, matter=Matter(MIRROR)))
    command = ["bake", "sample:blazed", "-o", str(tmp_path / "out"), "--model", "patch", "--matter", "gold"]
    assert parser.main([*command, "--no-cache", "--progress", "none"]) == 1
    out, err = capsys.readouterr()
    told = "the patch model takes only a dielectric; choose --model ensemble, or --matter dielectric\n"
    assert out == "" and len(err.splitlines()) == 1 and err.startswith("error: ") and err.endswith(told)
    assert "blazed" in err and not (tmp_path / "out").exists()


def test_needs_that_end_where_the_table_begins_are_refused():
    with pytest.raises(GratingError, match="w up to 0.26: .*; give a larger w"):
        patch.plan([RELIEF], BakeRequest(coherence_length_m=LENGTH_M, needs=Needs(w=(0.0, W_MIN + 0.01))))


@pytest.mark.night("test_a_window_elsewhere_shows_the_first_order_of_what_is_there")
def test_the_verb_takes_the_model(tmp_path, capsys):
    needs = tmp_path / "needs.json"
    needs.write_text(json.dumps({"format": 1, "u": [-0.3, 0.1], "v": [-0.05, 0.05], "w": [1.5, 2.0]}))
    command = ["bake", "sample:blazed", "-o", str(tmp_path / "out"), "--model", "patch", "--coherence-um", "10"]
    command += ["--patch-um", "3,4.5"]
    options = ["--needs", str(needs), "--no-cache", "--json", "-", "--progress", "none"]
    assert parser.main([*command, *options]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert len(facts["files"]) == 1
    assert facts["coherence_um"] == pytest.approx(10)
    assert facts["delta_e"]["p99"] <= 1
    assert read_request(Path(facts["files"][0])).patch_um == (3.0, 4.5)
