# SPDX-License-Identifier: GPL-3.0-or-later
"""The verb `info`."""

import json

import pytest

from .conftest import PICTURE


def test_info_prints_what_it_found(run):
    status, out, err = run("info", "sample:sinusoidal")
    assert (status, err) == (0, "")
    assert "rows: 832" in out.splitlines()
    assert out.startswith("relief: 200 nm\ngrating: 2500 nm at 0 deg, 26 repeats in the scan; ")


def test_info_as_json(run, scan):
    status, out, err = run("info", scan, *PICTURE, "--json", "-")
    assert (status, err) == (0, "")
    facts = json.loads(out)
    assert set(facts) == {
        "rows", "cols", "pixel_size_m", "height_range_m", "height_rms_m", "source_range_m", "periods_m",
        "period_angles_deg", "gratings", "waviness", "fine", "line_noise", "quality", "levelling",
        "channels",
    }  # fmt: skip
    assert (facts["rows"], facts["cols"]) == (48, 48)
    assert facts["periods_m"][0] == pytest.approx(0.8e-6, rel=0.1)


def test_info_to_a_file(run, scan, tmp_path):
    status, out, _ = run("info", scan, *PICTURE, "--json", tmp_path / "facts.json")
    assert status == 0 and "rows: 48" in out
    assert json.loads((tmp_path / "facts.json").read_text())["rows"] == 48
