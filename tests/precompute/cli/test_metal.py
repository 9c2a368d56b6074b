# SPDX-License-Identifier: GPL-3.0-or-later
"""The verbs `bake`, `check` and `map` on metals, whose bakes have an albedo bound."""

import json
from dataclasses import replace

import numpy as np
import pytest

from precompute.cli import parser
from precompute.table import atlas, atlas_file
from tests.precompute.bake.same_bake import assert_same_bake

SURFACE = "sample:blazed"
QUICK = ("--pairs", "1000", "--step-nm", "10", "--progress", "none")


@pytest.fixture(scope="module")
def baked(tmp_path_factory):
    """The file of a metal's bake."""
    folder = tmp_path_factory.mktemp("metal")
    line = ["bake", SURFACE, "--matter", "metal", "--coherence-um", "4", "-o", str(folder), "--no-cache"]
    assert parser.main([*line, "--progress", "none"]) == 0
    return folder / "blazed.exr"


def spoilt(baked, path, *, request=None, **changes):
    """Write the bake's file with a changed table, or with changes of the request in its header; return its path."""
    table, record = atlas_file.read(baked)
    for key in ("format", "layout"):
        del record[key]
    record["request"] |= request or {}
    atlas_file.write_together({path: atlas.pack(replace(table, **changes))}, record)
    return path


def test_its_file_holds_a_bound(baked):
    table, record = atlas_file.read(baked)
    assert record["request"]["matter"] == "metal"
    assert table.metal and table.excess_albedo.max() > 0.1
    layout, _ = atlas_file.read_header(baked)
    assert layout.metal and layout.bound_texels == len(table.excess_albedo)


def test_it_passes_its_check(run, baked):
    """The errors are those of the bake: two samples of one distribution, drawn by two programs."""
    status, out, err = run("check", baked, SURFACE, *QUICK, "--json", "-")
    facts, claimed = json.loads(out), atlas_file.read_header(baked)[1]["delta_e"]
    assert (status, err) == (0, "") and facts["passed"]
    assert facts["delta_e"]["p99"] <= 1
    for name in ("mean", "p95", "p99"):
        assert facts["delta_e"][name] == pytest.approx(claimed[name], rel=0.6)
    # The bound is measured at some of the pairs.
    assert 40 < facts["delta_e"]["pairs"] < sum(ring["pairs"] for ring in facts["rings"]) / 8


@pytest.mark.parametrize("name", ["no bound", "twice the excess", "black"])
def test_a_wrong_metal_fails(refused, baked, tmp_path, name):
    table, _ = atlas_file.read(baked)
    changes = {
        "no bound": {"excess_albedo": 0 * table.excess_albedo},
        "twice the excess": {"excess_albedo": 2 * table.excess_albedo},
        "black": {"terms": 0 * table.terms},
    }
    told = refused("check", spoilt(baked, tmp_path / "odd.exr", **changes[name]), SURFACE, *QUICK)
    assert "dE00" in told


def test_its_request_repeats_it(run, baked, tmp_path):
    assert run("bake", "--request", baked, "-o", tmp_path / "again", "--progress", "none")[0] == 0
    assert_same_bake(tmp_path / "again" / "blazed.exr", baked)


def test_the_cache_tells_a_metal_from_a_dielectric(run, tmp_path):
    options = ("--coherence-um", "2", "--delta-e", "5", "--progress", "none", "--json", "-")
    cached = []
    for number, matter in enumerate(("dielectric", "metal", "metal", "dielectric")):
        line = ("bake", SURFACE, *options, "--matter", matter, "-o", tmp_path / f"{number}")
        status, out, _ = run(*line)
        assert status == 0
        cached.append(json.loads(out)["cached"])
        assert atlas_file.read_header(tmp_path / f"{number}" / "blazed.exr")[0].metal == (matter == "metal")
    assert cached == [False, False, True, True]


def test_an_unknown_matter_is_refused(refused, baked, tmp_path):
    options = ("-o", tmp_path / "out", "--progress", "none")
    told = refused("bake", SURFACE, "--matter", "wood", *options, status=2)
    assert "--matter" in told and "wood" in told
    path = spoilt(baked, tmp_path / "wooden.exr", request={"matter": "wood"})
    told = refused("bake", "--request", path, *options)
    assert told == f"error: {path}: matter: cannot be 'wood'; give one of dielectric, metal\n"


def test_its_map_is_in_both_forms(run, baked, tmp_path):
    """Stam's form has no bound, so nowhere less light. The pictures differ, although each has its own exposure."""
    pixels = {}
    for form in ("material", "stam"):
        path = tmp_path / f"{form}.exr"
        line = ("map", baked, "--form", form, "--theta-i", "70", "--size", "48", "-o", path, "--progress", "none")
        assert run(*line)[0] == 0
        pixels[form] = np.asarray(atlas_file.open_picture(path).pixels())
    assert (pixels["material"] <= pixels["stam"] + 1e-6 * pixels["stam"].max()).all()
    assert np.ptp(pixels["stam"] - pixels["material"]) > 0.01 * pixels["stam"].max()
