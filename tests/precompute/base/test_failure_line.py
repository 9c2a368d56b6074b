# SPDX-License-Identifier: GPL-3.0-or-later
"""A failure comes from a child process with its fields."""

import json
import subprocess
import sys

import pytest

from precompute.base.failure import GratingError, Setting
from precompute.base.strict import failure_in, failure_line

FAILURE = GratingError("a.png", "it does not store its size", ("give ", Setting.SIZE_UM, ", or crop it"))


def fields(error):
    return error.what, error.fault, error.remedy


@pytest.mark.parametrize("failure", [
    FAILURE, GratingError("", "no memory", "crop it"),
    GratingError("\udcff\n.png", "ä; b: c", ("take ", Setting.MODEL)),
])  # fmt: skip
def test_the_fields_come_back(failure):
    line = failure_line(failure)
    assert line.isascii() and "\n" not in line
    found = failure_in(["[...]", line])
    assert str(found) == str(failure)
    assert (found.what, found.fault) == (failure.what, failure.fault)
    assert set(found.remedy) & set(Setting) == set(failure.remedy) & set(Setting)


def test_a_setting_of_a_newer_version_is_an_option():
    remedy = ["ask for a larger ", {"setting": "--grain-nm"}, " or ", {"setting": "--delta-e"}]
    found = failure_in([json.dumps({"error": {"what": "a.png", "fault": "too fine", "remedy": remedy}})])
    assert found.remedy == ("ask for a larger ", "--grain-nm", " or ", Setting.DELTA_E)
    assert str(found) == "a.png: too fine; ask for a larger --grain-nm or --delta-e"


@pytest.mark.parametrize("line", [
    "", "{", failure_line(FAILURE)[:-5], "error: a.png: it does not store its size; give --size-um",
    '{"stage": "bake", "fraction": 0.5}', '{"error": null}', '{"error": {"what": "a.png"}}',
    '{"error": {"what": 1, "fault": "", "remedy": []}}', '{"error": {"what": "", "fault": "", "remedy": "crop it"}}',
    "{" * 100_000,
])  # fmt: skip
def test_what_is_no_failure_is_none(line):
    assert failure_in([line]) is None


def test_the_last_failure_counts():
    later = GratingError("b.png", "broken", "copy it again")
    assert str(failure_in([failure_line(FAILURE), failure_line(later), '{"error": {"what": "a'])) == str(later)


def run(*words):
    command = [sys.executable, "-m", "precompute", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


@pytest.mark.parametrize(("style", "starts"), [("json", '{"error": '), ("text", "error: "), ("none", "error: ")])
def test_the_program_tells_a_failure_in_the_style_of_its_progress(tmp_path, style, starts):
    done = run("info", str(tmp_path / "no.gwy"), "--progress", style)
    assert done.returncode == 1 and done.stderr.startswith(starts) and done.stderr.count("\n") == 1


def test_the_fields_survive_the_process(tmp_path):
    from PIL import Image

    path = tmp_path / "scan.png"
    Image.new("L", (8, 8)).save(path)
    done = run("bake", str(path), "-o", str(tmp_path / "out"), "--progress", "json")
    assert fields(failure_in(done.stderr.splitlines())) == (
        str(path), "a picture stores no width", ("give ", Setting.SIZE_UM, ", the width of the scan in micrometres"),
    )  # fmt: skip
