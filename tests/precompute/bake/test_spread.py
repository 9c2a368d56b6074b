# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes of skins that lie in many directions."""

import numpy as np
import pytest
from PIL import Image

from laboratory.verbs import PACKAGES
from precompute.bake import ensemble
from precompute.bake.make import make
from precompute.bake.needs import Needs
from precompute.bake.request import BakeRequest
from precompute.base.failure import GratingError
from precompute.cli import parser
from precompute.optics.region import Region
from precompute.spectra.series import over_turns
from precompute.spectra.spectrum import FrequencyGrid
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare

PIXEL = 80e-9
SPREAD_DEG = 3.0
Q = np.arange(-100, 101) * 0.02
GRID = FrequencyGrid(Q, Q, (201, 201))


def gaussian(x, y, sigma):
    return np.exp(-((Q - x) ** 2 + (Q[:, None] - y) ** 2) / (2 * sigma**2)).astype(np.float32)


def moments(power):
    """Mean radius, and the standard deviations of radius and angle."""
    radius, angle = np.hypot(Q, Q[:, None]), np.arctan2(Q[:, None], Q)
    share = power / power.sum(dtype=float)
    mean = float((share * radius).sum())
    across = np.sqrt((share * (radius - mean) ** 2).sum())
    return mean, across, np.sqrt((share * (angle - (share * angle).sum()) ** 2).sum())


def test_an_order_widens_along_its_ring_alone():
    """Variances of angles add. Cubic convolution keeps the variance of a Gaussian of 2.5 bins to 1 %."""
    before = gaussian(1.0, 0.8, 0.05)
    after = over_turns(before, GRID, 0.1)
    assert after.dtype == np.float32 and after.min() >= 0
    assert after.sum(dtype=float) == pytest.approx(before.sum(dtype=float), rel=1e-6)
    (mean, across, angle), (mean_after, across_after, angle_after) = moments(before), moments(after)
    assert mean_after == pytest.approx(mean, rel=1e-3) and across_after == pytest.approx(across, rel=0.01)
    assert angle_after == pytest.approx(np.hypot(angle, 0.1), rel=0.01)


def test_a_round_spectrum_stays():
    before = gaussian(0, 0, 0.3)
    assert np.abs(over_turns(before, GRID, 0.5) - before).max() <= 1e-3


def scan(periodic=False):
    """20 um of a cosine with a period of 1 um along x; its first orders at 532 nm are at u = 0.532."""
    waves = 50e-9 * np.cos(2e6 * np.pi * PIXEL * np.arange(256))
    return prepare(HeightMap(np.tile(waves, (256, 1)), (PIXEL, PIXEL), "waves", periodic=periodic))


def test_a_bake_shows_the_first_order_along_its_ring():
    """The variance along the ring grows by the spread's square, and the mean over the ring stays. The bake may be off
    by a dE00 of 1, under 3 % of the light, so the variance by under 6 %."""
    needs = Needs(Region((0.35, 0.6), (-0.25, 0.25)), w=(1.4, 1.8))
    angle = np.linspace(-0.4, 0.4, 801)
    u, v = 0.532 * np.cos(angle), 0.532 * np.sin(angle)
    found = []
    for spread in (None, SPREAD_DEG):
        made = make([scan()], BakeRequest(1.0, 8e-6, "532nm", needs=needs, spread_deg=spread))
        assert made.errors.p99 <= 1
        light = made.table.scattered_over_w2(u, v, 1.6)[:, 1]
        found.append((light.sum(), (light * angle**2).sum() / light.sum()))
    (whole, variance), (spread_whole, spread_variance) = found
    assert spread_whole == pytest.approx(whole, rel=0.03)
    assert spread_variance == pytest.approx(variance + np.radians(SPREAD_DEG) ** 2, rel=0.06)


def test_spreading_reports_its_progress():
    """After the transforms, one step for each node of the series. None is a tenth of the bar."""
    told = []
    needs = Needs(Region((0.35, 0.6), (-0.25, 0.25)), w=(1.4, 1.8))
    request = BakeRequest(3.0, 8e-6, "532nm", needs=needs, spread_deg=SPREAD_DEG)
    make([scan()], request, progress=lambda *report: told.append(report))
    stages, fractions = zip(*told, strict=True)
    order = list(dict.fromkeys(stages))
    assert order.index("directions") == order.index("transforms") + 1
    assert stages.count("directions") == stages.count("transforms") > 3
    steps = np.diff(fractions)
    assert (steps >= 0).all() and steps[np.array(stages[1:]) == "directions"].max() < 0.1


def test_what_has_no_directions_is_refused():
    told = "edges wrap, or a profile, has only one direction; leave --spread-deg out"
    with pytest.raises(GratingError, match=told):
        ensemble.plan([scan(periodic=True)], BakeRequest(spread_deg=2.0))
    profile = prepare(HeightMap(np.sin(np.arange(500.0))[None] * 1e-8, (PIXEL, PIXEL), "profile"))
    with pytest.raises(GratingError, match=told):
        ensemble.plan([profile], BakeRequest(spread_deg=2.0))


def test_the_verbs(tmp_path, capsys):
    """`bake` records the spread, and `check`, which knows none, refuses in one line."""
    heights = 30e-9 * np.random.default_rng(0).standard_normal((48, 48))
    picture = tmp_path / "skin.png"
    Image.fromarray(np.uint8(127 + 1e9 * heights)).save(picture)
    size = ["--size-um", "4", "--height-nm", "250", "--progress", "none"]
    command = ["bake", str(picture), "-o", str(tmp_path / "out"), *size, "--spread-deg", "5", "--coherence-um", "2"]
    assert parser.main([*command, "--no-cache", "--delta-e", "5"]) == 0
    capsys.readouterr()
    assert parser.main(["check", str(tmp_path / "out"), str(picture), *size], PACKAGES) == 1
    err = capsys.readouterr().err
    assert "its directions are spread, which check cannot measure; bake without --spread-deg" in err
    assert len(err.splitlines()) == 1
