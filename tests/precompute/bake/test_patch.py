# SPDX-License-Identifier: GPL-3.0-or-later
"""The patch model's bake against the patch model's reference."""

import json

import numpy as np
import pytest

from precompute.bake import patch
from precompute.bake.make import make
from precompute.bake.needs import Needs
from precompute.bake.patch import W_MIN
from precompute.bake.patch_series import patch_series
from precompute.bake.request import BakeRequest
from precompute.base.failure import GratingError
from precompute.cli import parser
from precompute.methods.exact import Patch
from precompute.methods.method import Settings
from precompute.methods.method_registry import METHODS
from precompute.optics.region import Region
from precompute.reference.ensemble_reference import blurred
from precompute.reflectance.matter import MIRROR, Matter
from precompute.spectra.patch_window import PatchWindow
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
    got = blurred(power, series.grid, (u, v), lam=lam, sigma_b=series.kernel_left(series.sigma_b, lam))
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


def test_a_table_begins_where_polynomials_can_follow():
    plan = patch.plan(
        [RELIEF], BakeRequest(delta_e=4.0, coherence_length_m=LENGTH_M, needs=Needs(Region((-0.1, 0.1), (-0.1, 0.1))))
    )
    assert plan.w_range == (W_MIN, 2.0)


def test_several_scans_are_refused():
    with pytest.raises(GratingError, match="2 scans: the patch model is of one"):
        patch.plan([RELIEF, RELIEF], BakeRequest(coherence_length_m=LENGTH_M))


def test_a_metal_is_refused(tmp_path, capsys):
    with pytest.raises(GratingError, match="the patch model is of a dielectric; choose "):
        patch.plan([RELIEF], BakeRequest(coherence_length_m=LENGTH_M, matter=Matter(MIRROR)))
    command = ["bake", "sample:blazed", "-o", str(tmp_path / "out"), "--model", "patch", "--matter", "gold"]
    assert parser.main([*command, "--no-cache", "--progress", "none"]) == 1
    out, err = capsys.readouterr()
    told = "the patch model is of a dielectric; choose --model ensemble, or --matter dielectric\n"
    assert out == "" and len(err.splitlines()) == 1 and err.startswith("error: ") and err.endswith(told)
    assert "blazed" in err and not (tmp_path / "out").exists()


def test_needs_that_end_where_the_table_begins_are_refused():
    with pytest.raises(GratingError, match="w up to 0.26: .*; give a larger w"):
        patch.plan([RELIEF], BakeRequest(coherence_length_m=LENGTH_M, needs=Needs(w=(0.0, W_MIN + 0.01))))


def test_the_verb_takes_the_model(tmp_path, capsys):
    needs = tmp_path / "needs.json"
    needs.write_text(json.dumps({"format": 1, "u": [-0.3, 0.1], "v": [-0.05, 0.05], "w": [1.5, 2.0]}))
    command = ["bake", "sample:blazed", "-o", str(tmp_path / "out"), "--model", "patch", "--coherence-um", "10"]
    options = ["--needs", str(needs), "--no-cache", "--json", "-", "--progress", "none"]
    assert parser.main([*command, *options]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert len(facts["files"]) == 1
    assert facts["coherence_um"] == pytest.approx(10)
    assert facts["delta_e"]["p99"] <= 1
