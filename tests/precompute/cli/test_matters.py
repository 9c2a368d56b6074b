# SPDX-License-Identifier: GPL-3.0-or-later
"""The verbs `bake`, `check` and `map` on matters other than dielectrics."""

import json
from dataclasses import replace

import numpy as np
import pytest

from precompute.cli import parser
from precompute.reflectance.matter import parse
from precompute.table import atlas
from tests.precompute.bake.same_bake import assert_same_bake

from .conftest import LASER

SURFACE = "sample:blazed"
QUICK = ("--pairs", "300", "--step-nm", "10", "--progress", "none")


@pytest.fixture(scope="module")
def baked(tmp_path_factory):
    """The file of a bake of gold."""
    folder = tmp_path_factory.mktemp("gold")
    line = ["bake", SURFACE, "--matter", "gold", "--coherence-um", "4", "-o", str(folder), "--no-cache"]
    assert parser.main([*line, "--progress", "none"]) == 0
    return folder / "blazed.exr"


def spoilt(baked, path, *, request=None, **changes):
    """Write the bake's file with a changed table, or with changes of the request in its header; return its path."""
    table, record = atlas.read(baked)
    for key in ("format", "layout"):
        del record[key]
    record["request"] |= request or {}
    atlas.write_together({path: atlas.pack(replace(table, **changes))}, record)
    return path


def test_its_file_holds_a_reflectance(baked):
    table, record = atlas.read(baked)
    assert record["request"]["matter"] == "gold"
    assert table.holds_reflectance and table.largest_albedo > 1


@pytest.mark.night("tests/precompute/laboratory/check/test_lamps.py")
def test_it_passes_its_check(run, baked):
    """The errors are those of the bake: two samples of one distribution, drawn by two programs. They depend on w, so a
    few values of it would be no sample."""
    status, out, err = run("check", baked, SURFACE, *QUICK, "--groups", "8", "--json", "-")
    facts, claimed = json.loads(out), atlas.read_header(baked)[1]["delta_e"]
    assert (status, err) == (0, "") and facts["passed"]
    assert facts["delta_e"]["p99"] <= 1
    for name in ("mean", "p95", "p99"):
        assert facts["delta_e"][name] == pytest.approx(claimed[name], rel=0.6)


@pytest.mark.night("tests/precompute/cli/test_level.py")
@pytest.mark.parametrize(("name", "fault"), [("undivided", "|dY|"), ("black", "dE00")])
def test_a_wrong_metal_fails(refused, baked, tmp_path, name, fault):
    table, _ = atlas.read(baked)
    changes = {"undivided": {"largest_albedo": 1.0}, "black": {"terms": 0 * table.terms}}
    told = refused("check", spoilt(baked, tmp_path / "odd.exr", **changes[name]), SURFACE, *QUICK, "--step-nm", "20")
    assert fault in told


@pytest.mark.night("test_its_file_holds_a_reflectance")
def test_its_request_repeats_it(run, baked, tmp_path):
    assert run("bake", "--request", baked, "-o", tmp_path / "again", "--progress", "none")[0] == 0
    assert_same_bake(tmp_path / "again" / "blazed.exr", baked)


def test_the_cache_tells_matters_apart_and_knows_two_spellings(run, tmp_path):
    options = ("--coherence-um", "2", *LASER, "--progress", "none", "--json", "-")
    cached = []
    films = "1.46/200nm, aluminium", "silica 1.46 / 0.2 um,aluminum"
    for number, matter in enumerate(("dielectric", "mirror", *films, "1.46/201nm, aluminium", "dielectric")):
        line = ("bake", "sample:flat", *options, "--matter", matter, "-o", tmp_path / f"{number}")
        status, out, _ = run(*line)
        assert status == 0
        cached.append(json.loads(out)["cached"])
        layout, record = atlas.read_header(tmp_path / f"{number}" / "flat.exr")
        assert layout.holds_reflectance == (matter != "dielectric")
        assert record["request"]["matter"] == str(parse(matter))
    assert cached == [False, False, False, True, False, True]


@pytest.mark.parametrize(
    ("matter", "fault"),
    [
        ("wood", "wood: is not a known matter; give dielectric, mirror, aluminium"),
        ("1.5/0nm, gold", "1.5/0nm: is 0nm thick; give more than 0"),
        ("", "is empty; give dielectric"),
        ("1.5/100nm", "1.5/100nm: has no substrate; end with an index"),
    ],
)
def test_a_wrong_matter_is_refused(refused, tmp_path, matter, fault):
    options = ("-o", tmp_path / "out", "--progress", "none")
    told = refused("bake", SURFACE, "--matter", matter, *options, status=2)
    assert f"argument --matter: {fault}" in told
    path = tmp_path / "request.json"
    path.write_text(json.dumps({"matter": matter, "scans": [{"source": SURFACE}]}))
    told = refused("bake", "--request", path, *options)
    assert told.startswith(f"error: {path}: matter: {fault}")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("matter", ["wood", "dielectric", ["gold"], "1.5/0nm, gold", "9" * 3000])
def test_a_forged_matter_is_refused(refused, baked, tmp_path, matter):
    """Also a dielectric, whose table would hold no reflectance."""
    path = spoilt(baked, tmp_path / "forged.exr", request={"matter": matter})
    for line in (("bake", "--request", path), ("map", path), ("check", path, SURFACE)):
        options = () if line[0] == "check" else ("-o", tmp_path / "out.png")
        told = refused(*line, *options, "--progress", "none")
        assert told.startswith(f"error: {path}: its header's matter") and told.endswith("; bake it again\n")
        assert len(told) < 400 + len(str(path))


def test_a_dielectrics_table_cannot_claim_a_reflectance(run, refused, tmp_path):
    options = ("--coherence-um", "2", *LASER, "--progress", "none", "-o", tmp_path)
    assert run("bake", SURFACE, *options)[0] == 0
    path = spoilt(tmp_path / "blazed.exr", tmp_path / "forged.exr", request={"matter": "gold"})
    for line in (("map", path, "-o", tmp_path / "out.png"), ("check", path, SURFACE)):
        assert "its header's matter" in refused(*line, "--progress", "none")


def test_its_map_is_in_both_forms(run, baked, tmp_path):
    """The pictures differ, although each has its own exposure."""
    pixels = {}
    for form in ("material", "stam"):
        path = tmp_path / f"{form}.exr"
        line = ("map", baked, "--form", form, "--theta-i", "70", "--size", "48", "-o", path, "--progress", "none")
        assert run(*line)[0] == 0
        pixels[form] = np.asarray(atlas.open_picture(path).pixels())
    assert np.ptp(pixels["stam"] - pixels["material"]) > 0.01 * pixels["stam"].max()
