# SPDX-License-Identifier: GPL-3.0-or-later
"""The verb `info`."""

import json

import numpy as np
import pytest

from precompute.bake.request import request_from
from precompute.render_job.job_file import read_job

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


def test_numbers_in_metres(run, tmp_path):
    """The factor that docs/formats.md gives, 1e9, also in a request and in a job's file."""
    np.savetxt(tmp_path / "a.txt", 1e-7 * np.tile(np.arange(16.0) % 2, (16, 1)))
    status, out, _ = run("info", tmp_path / "a.txt", "--size-um", "2", "--height-nm", "1e9", "--json", "-")
    assert status == 0 and json.loads(out)["source_range_m"] == pytest.approx(1e-7)
    assert request_from({"scans": [{"source": "a.txt", "size_um": 2, "height_nm": 1e9}]}, "a").scans[0].height_nm == 1e9
    job = tmp_path / "job.toml"
    job.write_text('scene = "a.blend"\n[[grating]]\nscans = ["a.txt"]\nsize_um = 2\nheight_nm = 1e9')
    assert read_job(job).surfaces[0].request.scans[0].height_nm == 1e9
