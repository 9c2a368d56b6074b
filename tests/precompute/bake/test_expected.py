# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake first reports its expected memory and time, and refuses too much."""

import re

import numpy as np
import pytest

from precompute.bake import plan as expected
from precompute.bake.ensemble import plan
from precompute.bake.make import make
from precompute.bake.request import BakeRequest
from precompute.base import machine
from precompute.base.failure import GratingError
from precompute.spectra.series import Work
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare

MIB = 1 << 20


def scan_of(side=48, width_m=4e-6, height_m=200e-9):
    x = np.arange(side) / side
    waves = np.sin(2 * np.pi * 5 * x) + 0.2 * np.sin(2 * np.pi * (3 * x[:, None] + x))
    return HeightMap(waves * height_m / np.ptp(waves), (width_m / side,) * 2, "scan.png")


@pytest.fixture
def little(monkeypatch):
    monkeypatch.setattr(machine, "free_bytes", lambda: 64 * MIB)


def test_a_relief_that_is_refined_beyond_memory_is_refused(little):
    """A picture of 1332 x 1332 pixels is declared a millimetre wide, so each pixel is refined to 8 x 8."""
    wide = HeightMap(np.broadcast_to(0.0, (1332, 1332)), (1e-3 / 1332,) * 2, "skin.png")
    with pytest.raises(GratingError, match=r"^skin.png: .*10656 x 10656 .* more than half of the 64 MiB .*; crop"):
        prepare(wide)
    assert prepare(scan_of()).height_m.shape == (48, 48)


def test_a_bake_tells_what_it_expects_before_its_transforms():
    stages = []
    plan([prepare(scan_of())], BakeRequest(delta_e=5), progress=lambda stage, _: stages.append(stage))
    assert re.fullmatch(r"expects \d+ MiB and about \d+ s", stages[0])
    assert stages[1] == "transforms"
    assert sum(stage.startswith("expects") for stage in stages) == 1


def test_a_bake_beyond_memory_is_refused_with_its_source(little):
    with pytest.raises(GratingError, match="^scan.png: the bake would take .* more than half of the 64 MiB .*; crop"):
        make([prepare(scan_of())], BakeRequest(delta_e=5), source="scan.png")


def test_scans_that_are_still_to_come_count(monkeypatch):
    monkeypatch.setattr(machine, "free_bytes", lambda: 2.5 * expected.expected_bytes(Work(8, 10**6, 10**6)))
    told = []
    expected.tell(Work(8, 10**6, 10**6), 100, scans=1, progress=lambda stage, _: told.append(stage))
    assert len(told) == 1
    with pytest.raises(GratingError, match="more than half"):
        expected.tell(Work(8, 10**6, 10**6), 100, scans=2, progress=lambda stage, _: told.append(stage))
    assert len(told) == 1


def test_long_work_is_told_in_minutes():
    told = []
    expected.tell(Work(100, 10**6, 10**6), 100, scans=1, progress=lambda stage, _: told.append(stage))
    # 3e-10 s for each of 100 wavelengths, 100 transforms, 100 nodes and 10^6 bins.
    assert told[0].endswith("about 5 min")


def test_a_relief_too_deep_for_any_spectrum_is_refused_at_once():
    """A picture of 48 x 48 pixels is declared a millimetre high, which takes 17,000 transforms."""
    deep = prepare(scan_of(height_m=1e-3))
    with pytest.raises(GratingError, match="a relief of 1.*e\\+03 um is too deep for its spectrum; "):
        plan([deep], BakeRequest())
