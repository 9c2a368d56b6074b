# SPDX-License-Identifier: GPL-3.0-or-later
"""The option --level: the steps are applied, recorded, repeated and checked."""

import json

import numpy as np
import pytest
from PIL import Image

from precompute.table.atlas import read_header

from .conftest import LASER, PICTURE

STEPS = "plane:robust,rotate:30,dust:6"
QUIET = ("--progress", "none", "--coherence-um", "2.5", *LASER)


@pytest.fixture
def dusty(scan):
    """The picture of the irregular grating, with a bright fleck."""
    grey = np.array(Image.open(scan))
    grey[30:33, 10:13] = 255
    Image.fromarray(grey).save(scan)
    return scan


@pytest.fixture
def baked(run, dusty, tmp_path):
    """The folder of a levelled bake, and its facts."""
    folder = tmp_path / "bakes"
    status, out, err = run("bake", dusty, *PICTURE, "-o", folder, *QUIET, "--level", STEPS, "--json", "-")
    assert (status, err) == (0, "")
    return folder, json.loads(out)


def test_the_steps_are_in_the_header_and_what_they_told_is_in_the_facts(baked):
    folder, facts = baked
    _, record = read_header(folder / "skin.exr")
    assert record["request"]["levelling"] == STEPS.split(",")
    turned, dust, coherence = facts["levelling"]
    assert turned == "rotate:30: 35 x 35 of 48 x 48 pixels are kept"
    assert dust.startswith("dust:6: ")
    assert coherence.startswith("warning: coherence of 2.5 um: reduced to ")
    # The record describes the scan before the steps.
    assert record["shape"] == [48, 48]


def test_the_bake_is_of_the_levelled_heights(baked, run, dusty, tmp_path):
    assert run("bake", dusty, *PICTURE, "-o", tmp_path / "plain", *QUIET)[0] == 0
    levelled, plain = (read_header(folder / "skin.exr")[1] for folder in (baked[0], tmp_path / "plain"))
    assert plain["request"]["levelling"] == ["plane"]
    assert levelled["heights_sha256"] == plain["heights_sha256"]
    assert levelled["height_range_m"] != plain["height_range_m"]


def test_it_is_repeated_from_its_header_and_taken_from_the_cache(baked, run, dusty, tmp_path):
    folder, facts = baked
    asked = ("--request", folder / "skin.exr", "-o", tmp_path / "again", "--json", "-", "--progress", "none")
    status, out, _ = run("bake", dusty, *asked)
    assert status == 0
    again = json.loads(out)
    assert again["cached"] and again["levelling"] == facts["levelling"]
    assert (tmp_path / "again" / "skin.exr").read_bytes() == (folder / "skin.exr").read_bytes()
    assert "rotate:30: 35 x 35" in run("bake", dusty, *asked[:4])[1]


def test_it_is_checked_against_the_levelled_heights(baked, run, dusty):
    folder, _ = baked
    status, out, err = run("check", folder, dusty, *PICTURE, "--pairs", "300", "--progress", "none")
    assert (status, err) == (0, ""), out


@pytest.mark.short("levelling0")
@pytest.mark.parametrize("levelling", [["grate"], [3], ["plane"] * 99])
def test_a_header_whose_steps_are_none_is_refused_by_check(baked, refused, dusty, levelling):
    folder, _ = baked
    file = folder / "skin.exr"
    content = file.read_bytes()
    told = json.dumps(STEPS.split(",")).encode()
    assert content.count(told) == 1
    file.write_bytes(content.replace(told, json.dumps(levelling).encode()[: len(told)].ljust(len(told))))
    assert "skin.exr" in refused("check", file, dusty, *PICTURE, "--pairs", "300", "--progress", "none")


def test_info_tells_the_levelled_heights(run, dusty):
    status, out, _ = run("info", dusty, *PICTURE, "--level", "plane,dust,lines", "--json", "-")
    assert status == 0
    facts = json.loads(out)
    assert [line.partition(": ")[0] for line in facts["levelling"]][0] == "dust:5"
    assert facts["source_range_m"] < 240e-9  # 255 is 250 nm
    assert json.loads(run("info", dusty, *PICTURE, "--json", "-")[1])["levelling"] == []
    assert "dust:5: " in run("info", dusty, *PICTURE, "--level", "dust")[1]


@pytest.mark.parametrize(("steps", "fault"), [
    ("grate", "grate: no such step; give one of plane"),
    ("rotate:wide", "rotate:wide: rotate: no such argument; give DEG"),
    ("", "give one of"), ("plane;dust", "give one of"),
])  # fmt: skip
def test_steps_that_are_none(run, dusty, tmp_path, steps, fault):
    for line in (("info", dusty, *PICTURE), ("bake", dusty, *PICTURE, "-o", tmp_path / "out")):
        status, out, err = run(*line, "--level", steps)
        assert (status, out) == (2, "") and fault in err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("steps", "fault"), [
    ("crop:9:9:10:10", "no pixel is between 9 and 10 um; give"), ("calibrate:90000", "far from 90000 nm; give"),
])  # fmt: skip
def test_steps_that_do_not_fit_the_scan(refused, dusty, tmp_path, steps, fault):
    assert fault in refused("info", dusty, *PICTURE, "--level", steps)
    told = refused("bake", dusty, *PICTURE, "-o", tmp_path / "out", *QUIET, "--level", steps)
    assert fault in told and str(dusty) in told
