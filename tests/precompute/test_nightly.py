# SPDX-License-Identifier: GPL-3.0-or-later
"""The nightly test: the choice, the check and the unpacking of Blender's daily build, and the workflow's file."""

import hashlib
import io
import json
import re
import tarfile
import zipfile

import numpy as np
import pytest

from devtools import ROOT
from devtools.daily_blender import SYSTEMS, check, fetch, newest, unpack
from devtools.nightly import COMPARE, ENGINES, RECORDS, TESTS, parser

WORKFLOW = (ROOT / ".github" / "workflows" / "nightly.yml").read_text(encoding="utf-8")


def build(system, **changed):
    """A line of Blender's list of builds."""
    platform, architectures, kind, _ = SYSTEMS[system]
    made = {"platform": platform, "architecture": architectures[0], "file_extension": kind, "branch": "main"}
    return made | {"file_mtime": 1, "url": f"{platform}.{kind}"} | changed


@pytest.mark.parametrize("system", SYSTEMS)
def test_the_newest_build_of_the_main_branch_is_taken(system):
    wanted = build(system, file_mtime=5)
    others = [build(each, file_mtime=9) for each in SYSTEMS if each != system]
    branch, record = build(system, file_mtime=9, branch="v52"), build(system, file_mtime=9, file_extension="sha256")
    foreign = build(system, file_mtime=9, architecture="riscv")
    assert newest([build(system), wanted, *others, branch, record, foreign], system) is wanted
    with pytest.raises(SystemExit, match="no daily build"):
        newest(others, system)


def test_a_damaged_or_strange_download_is_refused():
    record = hashlib.sha256(b"data").hexdigest()
    check(b"data", f"{record.upper()}  blender.zip\n", "blender.zip")
    for data, line in ((b"date", record), (b"data", "")):
        with pytest.raises(SystemExit, match="SHA-256"):
            check(data, line, "blender.zip")
    with pytest.raises(SystemExit, match="not on Blender's server"):
        fetch("https://builder.blender.org.example.org/a.zip")


def test_archives_are_unpacked_and_the_program_is_found(tmp_path):
    entry = tarfile.TarInfo("blender-5.4/blender")
    entry.size = 1
    with tarfile.open(tmp_path / "b.tar.xz", "w:xz") as packed:
        packed.addfile(entry, io.BytesIO(b"1"))
    with zipfile.ZipFile(tmp_path / "b.zip", "w") as packed:
        packed.writestr("blender-5.4/blender.exe", b"2")
    for name, system, data in (("b.tar.xz", "Linux", b"1"), ("b.zip", "Windows", b"2")):
        assert unpack(tmp_path / name, tmp_path / system, system).read_bytes() == data
    with zipfile.ZipFile(tmp_path / "empty.zip", "w") as packed:
        packed.writestr("blender-5.4/readme.html", b"3")
    with pytest.raises(SystemExit, match="0 programs"):
        unpack(tmp_path / "empty.zip", tmp_path / "empty", "Windows")


def test_the_workflow_names_files_that_exist_and_options_that_there_are():
    steps = [line.strip() for line in WORKFLOW.splitlines()]
    named = set(re.findall(r"\b(?:devtools|tests)/[\w/]+\.\w+", WORKFLOW))
    assert named == {"devtools/daily_blender.py", "devtools/nightly.py"}
    assert all((ROOT / name).is_file() for name in named)
    assert all(path.exists() for path in (COMPARE, RECORDS, TESTS))
    options = [line.partition(": ")[2].split() for line in steps if line.startswith("options:")]
    assert len(options) == len(SYSTEMS)
    for each in options:
        assert set(parser().parse_args(["a.zip", "--blender", "b", "--output", "c", *each]).engines) <= set(ENGINES)


def test_the_workflow_has_pinned_actions_few_rights_and_no_tabs():
    actions = re.findall(r"uses: (\S+)", WORKFLOW)
    assert actions
    assert all(re.fullmatch(r"actions/[\w-]+@v\d+\.\d+\.\d+", action) for action in actions)
    assert re.search(r"^permissions:\n  contents: read\n\n", WORKFLOW, re.MULTILINE)
    assert "write" not in WORKFLOW and "secrets" not in WORKFLOW and "\t" not in WORKFLOW


def test_the_zips_are_those_of_the_manifest_s_platforms():
    manifest = (ROOT / "blender_manifest.toml").read_text(encoding="utf-8")
    for name in re.findall(r"zip: (\w+)", WORKFLOW):
        assert f'"{name.replace("_", "-")}"' in manifest


def test_both_pictures_are_recorded():
    records = json.loads(RECORDS.read_text(encoding="utf-8"))
    assert set(records) == set(ENGINES)
    for numbers in records.values():
        mean = np.array(numbers["mean"])
        assert mean.shape == np.array(numbers["noise"]).shape == (16, 16, 3)
        # A spectrum: somewhere red is at least twice blue, and somewhere blue is more than red.
        assert (mean[..., 0] > 2 * mean[..., 2]).any() and (mean[..., 2] > mean[..., 0]).any()
