# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark of a bake's stages."""

import json

import pytest

from laboratory.benchmarks import bake
from precompute.bake import ensemble, make
from precompute.bake.request import Scan

SMALL = Scan("grating:sinusoidal?period_um=2&depth_nm=60")


@pytest.fixture(scope="module")
def found():
    return bake.measure(SMALL, "draft", transforms=1)


@pytest.mark.night("test_the_clocked_functions_are_as_before_afterwards")
def test_every_stage_of_a_dielectric_takes_its_time(found):
    """No largest albedo is computed for a dielectric."""
    stages = found["stages"]
    assert set(stages) == {*bake.BAKE, *bake.CHECK, bake.REST} - {"albedo"}
    assert min(stages.values()) >= 0 and sum(stages.values()) > 0


@pytest.mark.night("test_the_clocked_functions_are_as_before_afterwards")
def test_the_parts_are_the_whole(found):
    whole = bake.totals(found)
    assert whole["bake"] + whole["check"] == pytest.approx(sum(found["stages"].values()))
    assert whole["bake"] / whole["check"] == pytest.approx(whole["bake_in_transforms"] / whole["check_in_transforms"])
    text = bake.as_text("small", found)
    assert f"check over bake: {whole['check'] / whole['bake']:.2f}" in text


def test_the_clocked_functions_are_as_before_afterwards():
    before = make.with_levels, ensemble.fast_series
    seconds = bake.Counter()
    with pytest.raises(ZeroDivisionError), bake.clocked(seconds):
        assert make.with_levels is not before[0]
        1 / 0  # noqa: B018  ends the clocked part
    assert (make.with_levels, ensemble.fast_series) == before


def test_an_absent_scan_is_skipped_with_a_reason(found, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(bake, "in_child", lambda scan, quality: found)
    bake.main(["--runs", "1", "--shared", str(tmp_path), "--json", str(tmp_path / "rows.json")])
    said = capsys.readouterr().out
    assert f"elaphe, scan, good: skipped, the scan is not in {tmp_path}" in said
    rows = json.loads((tmp_path / "rows.json").read_text())["rows"]
    assert list(rows) == ["sample:elaphe, good", "sample:elaphe, draft"]
