# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake's progress covers the whole bake: it grows from 0 to 1 once, over all stages."""

import numpy as np
import pytest

from precompute.bake.make import make
from precompute.bake.request import BakeRequest
from precompute.base.failure import GratingError
from precompute.measure.errors import Errors
from precompute.reflectance.matter import parse
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare

STAGES = ["transforms", "wavelengths", "self-check"]


def relief(depth_m: float):
    """64 x 64 pixels of 60 nm with eight periods along the scan's x axis."""
    row = depth_m / 2 * np.sin(2 * np.pi * 8 * (np.arange(64) + 0.5) / 64)
    return prepare(HeightMap(np.tile(row, (64, 1)), (60e-9, 60e-9), source="waves", periodic=True))


def told_by(reliefs, request):
    """The distinct reported stages in order, and all fractions."""
    told = []
    try:
        make(reliefs, request, progress=lambda *report: told.append(report))
    except GratingError as refusal:
        assert "reaches a dE00" in str(refusal)
    stages, fractions = zip(*told, strict=True)
    return list(dict.fromkeys(stages)), np.array(fractions)


@pytest.mark.night("tests/precompute/cli/test_matters.py")
@pytest.mark.parametrize("matter", ["dielectric", "gold"])
@pytest.mark.parametrize("scans", [1, 2])
def test_one_bar_over_the_whole_bake(scans, matter):
    stages, fractions = told_by([relief(100e-9)] * scans, BakeRequest(delta_e=3.0, matter=parse(matter)))
    assert stages[0].startswith("expects ") and stages[1:] == STAGES
    assert (np.diff(fractions) >= 0).all()
    # The rest of the bar is for a second attempt, which is rare.
    assert fractions[-1] == pytest.approx(0.9)
    # No step is a tenth of the bar: 20 transforms, groups of wavelengths, pairs of the check.
    assert np.diff(fractions).max() < 0.1


@pytest.mark.night("tests/precompute/bake/test_spread.py")
def test_a_second_attempt_goes_on_where_the_first_ended(monkeypatch):
    monkeypatch.setattr(Errors, "over", lambda *_: 2.0)
    stages, fractions = told_by([relief(100e-9)], BakeRequest(delta_e=3.0))
    assert stages[0].startswith("expects ") and stages[1:] == STAGES
    assert (np.diff(fractions) >= 0).all()
    assert fractions[-1] == pytest.approx(1)
