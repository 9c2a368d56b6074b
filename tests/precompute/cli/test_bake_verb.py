# SPDX-License-Identifier: GPL-3.0-or-later
"""The verb `bake`: its facts, files, options and progress."""

import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from precompute.bake import ensemble
from precompute.bake.self_check import Judge
from precompute.measure.errors import Errors, measure
from precompute.measure.truths import truths
from precompute.surface.readers.reader_registry import read_height_map
from precompute.surface.relief import prepare
from precompute.table import atlas
from precompute.table.atlas import read_header
from precompute.table.blur_levels import TILE_PADDING
from tests.precompute.bake.same_bake import assert_same_bake

from .conftest import LASER, PICTURE, SHORT


@pytest.fixture
def baked(run, scan, tmp_path):
    """The facts of a bake of the picture, and the folder of its files."""
    folder = tmp_path / "new" / "bakes"
    status, out, err = run("bake", scan, *PICTURE, "-o", folder, "--delta-e", "3", "--json", "-", "--progress", "none")
    assert (status, err) == (0, "")
    return json.loads(out), folder


def test_bake_tells_its_facts_and_writes_its_files(baked, scan):
    facts, folder = baked
    assert {"seconds", "peak_bytes", "tiles", "resolution", "delta_e", "files", "cached"} <= set(facts)
    assert facts["files"] == [str(folder / "skin.exr"), str(folder / "skin.lobes.exr")]
    assert sorted(path.name for path in folder.iterdir()) == ["skin.exr", "skin.lobes.exr"]
    assert {"mean", "p95", "p99", "max"} <= set(facts["delta_e"])
    assert 0 < facts["delta_e"]["mean"] <= facts["delta_e"]["p95"] <= facts["delta_e"]["p99"] <= 3
    layout, record = read_header(folder / "skin.exr")
    tile = [n + 2 * TILE_PADDING for n in (layout.inner_rows, layout.inner_columns)]
    assert (layout.terms, tile) == (facts["tiles"], facts["tile"])
    assert record["delta_e"] == facts["delta_e"]
    assert facts["delta_e"]["p99"] <= facts["delta_e"]["p99_most"] <= 3
    assert record["request"]["matter"] == "dielectric" and not layout.holds_reflectance
    assert record["source"] == "skin.png"
    assert record["model"] == "ensemble"
    assert record["coherence_um"] == pytest.approx(facts["coherence_um"])
    # The picture is 4 um wide and holds 30 areas of 2 (l / 4)^2 at the coherence length l.
    assert facts["coherence_um"] == pytest.approx(4 * 4 / 60**0.5, rel=1e-6)
    heights = read_height_map(str(scan), 4, 250).height_m
    assert record["heights_sha256"] == [hashlib.sha256(heights.tobytes()).hexdigest()]
    assert record["shape"] == [48, 48]


def test_the_error_in_the_header_is_that_of_the_file(baked, scan):
    _, folder = baked
    table, record = atlas.read(folder / "skin.exr")
    relief = prepare(read_height_map(str(scan), 4, 250))
    truth = truths(relief, table.sigma_b, 2, pairs_each=500, step_m=5e-9, seed=99)
    errors = measure(truth, table.candidate)
    assert errors.p99 <= 3
    # Both means are of samples of the same distribution.
    assert errors.mean == pytest.approx(record["delta_e"]["mean"], rel=1)


@pytest.mark.night("test_the_error_in_the_header_is_that_of_the_file")
def test_bake_again_gives_the_same_file(baked, run, scan, tmp_path):
    _, folder = baked
    assert run("bake", scan, *PICTURE, "-o", tmp_path / "again", "--delta-e", "3", "--no-cache")[0] == 0
    assert_same_bake(tmp_path / "again" / "skin.exr", folder / "skin.exr")
    assert sorted(each.name for each in (tmp_path / "again").iterdir()) == ["skin.exr", "skin.lobes.exr"]


@pytest.mark.night("test_several_scans_and_a_region")
def test_bake_takes_its_options(run, scan, tmp_path):
    options = ("--delta-e", "5", *SHORT, "--illuminant", "E")
    status, out, _ = run("bake", scan, *PICTURE, "-o", tmp_path, *options, "--json", tmp_path / "facts.json")
    assert status == 0
    assert "skin.exr" in out and "dE00" in out
    facts = json.loads((tmp_path / "facts.json").read_text())
    # The scan's window leaves room for 0.56 of its side of 4 um, to the pixels of the window (bake/plan.py).
    assert facts["coherence_um"] == pytest.approx(0.56 * 4, rel=0.02)
    assert "warning: coherence of 4 um: reduced to 2.2" in out
    assert atlas.read(tmp_path / "skin.exr")[0].illuminant == "E"


@pytest.mark.night("test_bake_tells_its_facts_and_writes_its_files")
@pytest.mark.parametrize("light", ["D65", "smooth", "led+tube"])
def test_bake_tells_its_errors_under_lamps(run, scan, tmp_path, light):
    """One line after its other errors, with the figures of the JSON. Daylight's bake names the remedy."""
    options = ("--delta-e", "5", *SHORT, "--spectra", light, "--json", tmp_path / "facts.json")
    status, out, _ = run("bake", scan, *PICTURE, "-o", tmp_path, *options)
    lamps = json.loads((tmp_path / "facts.json").read_text())["delta_e"]["lamps"]
    (line,) = [line for line in out.splitlines() if line.startswith("under other lamps")]
    (mean, p95), told = (
        lamps["2700K"],
        [f"{lamp} {lamps[lamp][0]:.1f} and {lamps[lamp][1]:.1f}" for lamp in ("LED-B1", "FL11")],
    )
    assert status == 0 and f": 2700K {mean:.1f} and {p95:.1f}, {', '.join(told)}" in line
    assert ("; --illuminant smooth or led holds them" in line) == (light == "D65") == (p95 > 2)
    assert "lamp colour" not in out


@pytest.mark.night("test_a_bake_that_misses_its_budget_on_other_directions_is_not_written")
def test_a_bake_under_a_lamp_states_no_others(run, scan, tmp_path):
    """Blender's own colour of 2700 K in Rec.709."""
    _, out, _ = run("bake", scan, *PICTURE, "-o", tmp_path, "--delta-e", "5", *SHORT, "--illuminant", "tungsten")
    assert "other lamps" not in out and "lamp colour 1.935, 0.804, 0.192 (Rec.709)" in out


def test_a_mirror_under_a_short_coherence_bakes(run, tmp_path):
    """The smallest table that there is: two empty tiles."""
    black = tmp_path / "mirror.png"
    Image.fromarray(np.zeros((16, 16), np.uint8)).save(black)
    status, out, _ = run("bake", black, "--size-um", "2", "--height-nm", "100", "-o", tmp_path, "--json", "-")
    assert status == 0
    assert json.loads(out)["delta_e"]["max"] == 0
    assert not atlas.read(tmp_path / "mirror.exr")[0].terms.any()


@pytest.mark.night("test_bake_tells_its_facts_and_writes_its_files")
@pytest.mark.parametrize("matter", ["dielectric", "gold"])
def test_progress_as_json_lines(run, scan, tmp_path, matter):
    options = (*SHORT, *LASER, "--matter", matter)
    _, out, err = run("bake", scan, *PICTURE, "-o", tmp_path, *options, "--progress", "json", "--json", "-")
    json.loads(out)
    steps = [json.loads(line) for line in err.splitlines()]
    stages = list(dict.fromkeys(step["stage"] for step in steps))
    # The steps before the transforms may take seconds for a large scan, so they are reported too.
    assert stages[:2] == ["reading the scan", "levelling"]
    assert stages[2].startswith("expects ")
    assert stages[3:] == ["transforms", "wavelengths", "self-check"]
    fractions = [step["fraction"] for step in steps]  # without a second attempt the bar ends at 0.9
    assert fractions[0] == 0 and fractions == sorted(fractions) and 0.88 < fractions[-1] <= 1


def test_a_bake_that_misses_its_budget_is_not_written(refused, scan, tmp_path, monkeypatch):
    monkeypatch.setattr(
        ensemble, "judge", lambda *_, **__: Judge(lambda _: Errors(1, 7.31, 7.31, 9, 0, 0, 0, 10, 0.03))
    )
    told = refused("bake", scan, *PICTURE, "-o", tmp_path / "bakes", *SHORT, *LASER, "--progress", "none")
    assert "7.31" in told and "--delta-e 7.7" in told


def test_a_bake_that_misses_its_budget_on_other_directions_is_not_written(refused, run, scan, tmp_path, monkeypatch):
    """If the share below the percentile varies by 0.00315, as for a thousand independent pairs, the allowance is
    2 * (4.9 - 4) / ln 5 * 0.00315 / 0.01 = 0.35; for a tenth of this deviation it is a tenth."""
    asked = ("bake", scan, *PICTURE, "-o", tmp_path / "bakes", *SHORT, *LASER, "--progress", "none")
    few, many = (Errors(1, 4.0, 4.9, 9, 0, 0, 0, 1000, deviation) for deviation in (0.00315, 0.000315))
    monkeypatch.setattr(ensemble, "judge", lambda *_, **__: Judge(lambda _: few))
    told = refused(*asked)
    assert "4.90" in told and "up to 0.35 more" in told and "--delta-e 5.6" in told
    monkeypatch.setattr(ensemble, "judge", lambda *_, **__: Judge(lambda _: many))
    status, out, _ = run(*asked)
    assert status == 0 and "lamp colour" not in out, "a laser's colour is the lamp's own"


def test_several_scans_and_a_region(run, scan, tmp_path):
    """The two scans share one table. Its header names both scans, the region, and the hash of each scan."""
    other = tmp_path / "other.png"
    other.write_bytes(scan.read_bytes())
    needs = tmp_path / "needs.json"
    needs.write_text('{"format": 1, "u": [-0.5, 0.5], "v": [-0.2, 0.2], "w": [1, 2]}')
    options = (*PICTURE, *SHORT, *LASER, "--needs", needs)
    status, out, _ = run("bake", scan, other, *options, "-o", tmp_path / "bakes", "--json", "-", "--progress", "none")
    assert status == 0
    facts = json.loads(out)
    assert facts["files"][0] == str(tmp_path / "bakes" / "skin_and_1_more.exr")
    layout, record = read_header(Path(facts["files"][0]))
    assert record["source"] == "skin.png, other.png" and len(record["heights_sha256"]) == 2
    assert record["request"]["needs"]["u"] == [-0.5, 0.5]
    assert layout.cell_rows < layout.cell_columns and (layout.w_min, layout.w_max) == (1, 2)
    needs.write_text("{}")
    status, _, err = run("bake", scan, *options, "-o", tmp_path / "bakes")
    assert status == 1 and "needs.json" in err.splitlines()[-1]
