# SPDX-License-Identifier: GPL-3.0-or-later
"""The verdict of `check` on correct bakes, wrong bakes, and files that are not bakes."""

import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from precompute.cli import parser
from precompute.cli.map_verb import write_picture
from precompute.table import atlas
from precompute.table.atlas import read_header

PICTURE = ("--size-um", "4", "--height-nm", "250")
# A kernel of 0.06 in (u, v), by which a turn of 5 degrees moves the first order.
SHORT = ("--coherence-um", "4")
QUICK = ("--pairs", "1000", "--step-nm", "10", "--progress", "none")
# Enough for faults of several times what is asked.
COARSE = ("--pairs", "300", "--step-nm", "20", "--progress", "none")


@pytest.fixture(scope="module")
def baked(folder, scan):
    """The file of a bake of the picture."""
    line = ["bake", scan, *PICTURE, *SHORT, "-o", folder / "bakes", "--no-cache", "--progress", "none"]
    assert parser.main([str(each) for each in line]) == 0
    return folder / "bakes" / "skin.exr"


def spoilt(baked, path, fault, **header):
    """Write the bake's file with a changed table and header entries; return its path."""
    table, record = atlas.read(baked)
    for key in ("format", "layout"):
        del record[key]
    atlas.write_together({path: atlas.pack(fault(table))}, {**record, **header})
    return path


def turned(table, degrees):
    """Each tile turned about (0, 0), interpolated between its texels."""
    v, u = np.meshgrid(*table.axes, indexing="ij")
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    x = (c * u + s * v - table.first[1]) / table.texel
    y = (c * v - s * u - table.first[0]) / table.texel
    rows, columns = table.tile
    x0, y0 = (np.clip(np.floor(at).astype(int), 0, n - 2) for at, n in ((x, columns), (y, rows)))
    fx, fy = (np.clip(at - low, 0, 1)[..., None] for at, low in ((x, x0), (y, y0)))
    t = table.terms
    lower = t[:, y0, x0] * (1 - fx) + t[:, y0, x0 + 1] * fx
    upper = t[:, y0 + 1, x0] * (1 - fx) + t[:, y0 + 1, x0 + 1] * fx
    return replace(table, terms=(lower * (1 - fy) + upper * fy).astype(np.float32))


def test_a_bake_passes(run, baked, scan):
    status, out, err = run("check", baked, scan, *PICTURE, *QUICK)
    assert (status, err) == (0, "")
    assert (
        len(out.splitlines()) == 6
        and "under other lamps (mean dE00, 95th percentile): " in out
        and "shown greyer: Rec.709" in out
        and "dE00 mean" in out
        and "|dY|" in out
        and "large lamps: dE00 p99" in out
    )


def test_its_errors_are_those_of_the_bake(run, baked, scan):
    status, out, _ = run("check", baked.parent, scan, *PICTURE, *QUICK, "--json", "-")
    facts, record = json.loads(out), read_header(baked)[1]
    assert status == 0 and facts["passed"] and facts["faults"] == []
    assert facts["asked_delta_e"] == 1
    assert facts["delta_e"]["p99"] <= 1 and facts["delta_e"]["relative_dy"] <= 0.01
    # Two draws of 500 colours each, of which the share outside has a standard deviation of at most 0.022.
    assert facts["shown"]["Rec.709"]["outside"] == pytest.approx(record["shown"]["Rec.709"]["outside"], abs=0.1)
    # Two samples of one distribution, drawn by two programs.
    for name in ("mean", "p95", "p99"):
        assert facts["delta_e"][name] == pytest.approx(record["delta_e"][name], rel=0.6)
    assert facts["delta_e"]["pairs"] == sum(ring["pairs"] for ring in facts["rings"])
    assert sum(ring["light"] for ring in facts["rings"]) == pytest.approx(1)
    assert [ring["u_to"] for ring in facts["rings"]] == [0.1, 0.5, 1, 2]
    weighed = sum(ring["light"] * ring["relative_dy"] for ring in facts["rings"])
    assert weighed == pytest.approx(facts["delta_e"]["relative_dy"])


@pytest.mark.short("turned", "mirrored")
@pytest.mark.parametrize(("name", "fault"), [
    ("black", lambda table: replace(table, terms=0 * table.terms)),
    ("bright", lambda table: replace(table, terms=1.3 * table.terms)),
    ("turned", lambda table: turned(table, 5)),
    ("mirrored", lambda table: replace(table, terms=table.terms[:, ::-1])),
])  # fmt: skip
def test_a_wrong_bake_fails(refused, baked, scan, tmp_path, name, fault):
    path = spoilt(baked, tmp_path / f"{name}.exr", fault)
    told = refused("check", path, scan, *PICTURE, *COARSE)
    assert told.startswith(f"error: {path}: dE00 p99 ") and "asked 1" in told and "bake it again" in told


def test_a_turn_by_nothing_passes(run, baked, scan, tmp_path):
    """The interpolation of a turn alone does not fail a bake."""
    path = spoilt(baked, tmp_path / "turned.exr", lambda table: turned(table, 0))
    assert run("check", path, scan, *PICTURE, *QUICK)[0] == 0


@pytest.mark.parametrize("level", [1, 4])
def test_one_wrong_level_fails(run, baked, scan, tmp_path, level):
    """All levels are read, and each is compared with the light under its own kernel. 1.3 times the light is a dE00 of
    about 38.7 * 0.3 / 3 = 4 and more at Y = 1."""

    def fault(table):
        wider = list(table.wider)
        wider[level - 1] = 1.3 * wider[level - 1]
        return replace(table, wider=tuple(wider))

    path = spoilt(baked, tmp_path / "level.exr", fault)
    status, out, err = run("check", path, scan, *PICTURE, *QUICK, "--json", "-")
    facts, claimed = json.loads(out), read_header(baked)[1]["delta_e"]["wide_p99_most"]
    assert status == 1 and f"at blur level {level}, claimed {claimed:.2f}" in err
    wrong = [each["level"] for each in facts["wide"] if each["p99"] > 3]
    assert level in wrong and set(wrong) <= {level - 0.5, level, level + 0.5}
    assert facts["delta_e"]["p99"] <= 1


@pytest.mark.night("test_one_wrong_level_fails")
def test_the_claim_for_wider_kernels_is_kept(run, baked, scan):
    """Under every level's kernel and the middles between two, on other directions than those of the bake."""
    facts = json.loads(run("check", baked, scan, *PICTURE, *QUICK, "--groups", "8", "--json", "-")[1])
    claimed = read_header(baked)[1]["delta_e"]
    levels = len(atlas.read(baked)[0].levels)
    assert [each["level"] for each in facts["wide"]] == [half / 2 for half in range(1, 2 * levels - 1)]
    assert all(2 * each["p99"] - each["p99_most"] <= claimed["wide_p99_most"] for each in facts["wide"])
    assert claimed["claim"] >= max(claimed["p99_most"], claimed["wide_p99_most"], claimed["p99_of_w"])


def test_a_wrong_zero_order_fails(refused, baked, scan, tmp_path):
    path = spoilt(baked, tmp_path / "dim.exr", lambda table: replace(table, zero_order=0.99 * table.zero_order))
    told = refused("check", path, scan, *PICTURE, *QUICK)
    assert "zero order" in told and "dE00" not in told


def test_a_failure_gives_its_errors_all_the_same(run, baked, scan, tmp_path):
    path = spoilt(baked, tmp_path / "bright.exr", lambda table: replace(table, terms=1.3 * table.terms))
    status, out, err = run("check", path, scan, *PICTURE, *QUICK, "--json", "-")
    facts = json.loads(out)
    assert status == 1 and len(err.splitlines()) == 1
    # It fails in colour, under wider kernels and lamps too, and in light.
    assert not facts["passed"] and len(facts["faults"]) == 4
    assert facts["delta_e"]["relative_dy"] == pytest.approx(0.3, abs=0.01)


@pytest.mark.night("test_a_mirror_passes")
def test_what_was_asked_may_be_told(run, refused, baked, scan, tmp_path):
    assert "asked 0.01" in refused("check", baked, scan, *PICTURE, *COARSE, "--delta-e", "0.01")
    path = spoilt(baked, tmp_path / "loose.exr", lambda table: replace(table, terms=1.02 * table.terms))
    assert "|dY|" in refused("check", path, scan, *PICTURE, *QUICK)
    assert run("check", path, scan, *PICTURE, *QUICK, "--delta-e", "4")[0] == 0


def test_a_mirror_passes(run, refused, tmp_path):
    """Its scattered light is only rounding, so no share of it is asked."""
    black = tmp_path / "mirror.png"
    Image.fromarray(np.zeros((16, 16), np.uint8)).save(black)
    size = ("--size-um", "2", "--height-nm", "100", "--progress", "none")
    assert run("bake", black, *size, "-o", tmp_path, "--no-cache")[0] == 0
    bake = tmp_path / "mirror.exr"
    assert run("check", bake, black, *size, *QUICK)[0] == 0
    glow = spoilt(bake, tmp_path / "glow.exr", lambda table: replace(table, terms=table.terms + 0.1))
    assert "dE00" in refused("check", glow, black, *size, *QUICK)


def test_several_scans(run, refused, scan, tmp_path):
    other = tmp_path / "other.png"
    Image.open(scan).rotate(90).save(other)
    quick = (*PICTURE, *SHORT, "--delta-e", "5", "--illuminant", "532nm", "--no-cache", "--progress", "none")
    assert run("bake", scan, other, *quick, "-o", tmp_path / "both")[0] == 0
    assert run("check", tmp_path / "both", scan, other, *PICTURE, *QUICK)[0] == 0
    assert "2 height maps, not 1" in refused("check", tmp_path / "both", scan, *PICTURE, *QUICK)
    assert "another surface" in refused("check", tmp_path / "both", other, scan, *PICTURE, *QUICK)


@pytest.mark.night("test_several_scans")
def test_a_bake_of_a_part(run, scan, tmp_path):
    needs = tmp_path / "needs.json"
    needs.write_text(json.dumps({"format": 1, "u": [0.1, 1.3], "v": [-0.2, 0.4], "w": [0.9, 1.8]}))
    quick = (*PICTURE, *SHORT, "--needs", needs, "--no-cache", "--progress", "none")
    assert run("bake", scan, *quick, "-o", tmp_path / "part")[0] == 0
    status, out, _ = run("check", tmp_path / "part", scan, *PICTURE, *QUICK, "--json", "-")
    facts = json.loads(out)
    assert status == 0
    assert facts["delta_e"]["pairs"] > 1000
    assert all(0.9 <= w <= 1.8 for w in facts["w"])


def test_another_surface(refused, baked, scan, tmp_path):
    other = tmp_path / "other.png"
    Image.open(scan).rotate(180).save(other)
    assert "another surface" in refused("check", baked, other, *PICTURE, *QUICK)
    assert "another surface" in refused("check", baked, scan, "--size-um", "4", "--height-nm", "260", *QUICK)
    told = refused("check", baked, scan, "--size-um", "5", "--height-nm", "250", *QUICK)
    assert "pixels of 83.33 nm" in told and str(scan) in told


def test_bakes_that_are_none(refused, scan, tmp_path):
    assert "no such file" in refused("check", tmp_path / "missing.exr", scan, *PICTURE, *QUICK)
    assert "no bake" in refused("check", tmp_path, scan, *PICTURE, *QUICK)
    text = tmp_path / "text.exr"
    text.write_bytes(b"hello\n")
    assert "not a readable" in refused("check", text, scan, *PICTURE, *QUICK)
    picture = tmp_path / "picture.exr"
    write_picture(picture, np.ones((8, 8, 3)), "D65")
    assert "not a Natural Gratings bake" in refused("check", picture, scan, *PICTURE, *QUICK)


@pytest.mark.parametrize("share", [0.02, 0.5, 0.95])
def test_a_truncated_bake(refused, baked, scan, tmp_path, share):
    whole = baked.read_bytes()
    path = tmp_path / "half.exr"
    path.write_bytes(whole[: int(share * len(whole))])
    assert f"error: {path}: " in refused("check", path, scan, *PICTURE, *QUICK)


def test_another_model_and_another_version(refused, baked, scan, tmp_path):
    path = spoilt(baked, tmp_path / "patch.exr", lambda table: table, model="patch")
    assert "patch" in refused("check", path, scan, *PICTURE, *QUICK)
    path = spoilt(baked, tmp_path / "old.exr", lambda table: table, format=2)
    assert "format 2" in refused("check", path, scan, *PICTURE, *QUICK)


@pytest.mark.parametrize(("key", "value"), [
    ("terms", 99), ("terms", True), ("terms", 0), ("strip_rows", -1), ("texel", 0.0), ("texel", 1e300), ("sigma_b", 0),
    ("illuminant", "moon"), ("scale", "1"), ("scale", 1e39), ("columns", None), ("zero_order_samples", 1),
    ("rows", 2.5), ("inner_rows", 10**4), ("inner_columns", 0), ("levels", 10**9), ("levels", "2"), ("u_first", 9.0),
    ("ratio_ior", 0.5), ("largest_albedo", 0.5), ("level_ratio", 0.5), ("level_ratio", "2"),
    ("level_offset", -0.1), ("level_coarser", 0.5), ("level_coarser", None),
])  # fmt: skip
def test_a_header_that_cannot_be(refused, baked, scan, tmp_path, key, value):
    layout = {**atlas.read(baked)[1]["layout"], key: value}
    path = spoilt(baked, tmp_path / "odd.exr", lambda table: table, layout=layout)
    assert f"its header's {key} is invalid" in refused("check", path, scan, *PICTURE, *QUICK)


@pytest.mark.parametrize("layout", [
    {"cell_rows": 7}, {"w_max": 0.0}, {"cell_columns": 7}, {"sigma_b": float("nan")}, {"sigma_b": 10**400},
    None, [[]] * 99,
])  # fmt: skip
def test_a_header_that_does_not_fit(refused, baked, scan, tmp_path, layout):
    if isinstance(layout, dict):
        layout = {**atlas.read(baked)[1]["layout"], **layout}
    path = spoilt(baked, tmp_path / "odd.exr", lambda table: table, layout=layout)
    assert "its header" in refused("check", path, scan, *PICTURE, *QUICK)


@pytest.mark.parametrize("provenance", [
    {"asked_delta_e": "1"}, {"asked_delta_e": True}, {"asked_delta_e": -1}, {"asked_delta_e": [1]},
    {"pixel_size_m": 1}, {"pixel_size_m": ["1", "1"]}, {"pixel_size_m": [1e-9]}, {"pixel_size_m": {"x": 1e-9}},
    {"heights_sha256": "0" * 64}, {"heights_sha256": [0]}, {"heights_sha256": None}, {"heights_sha256": {"a": "b"}},
])  # fmt: skip
def test_provenance_of_other_types(refused, baked, scan, tmp_path, provenance):
    path = spoilt(baked, tmp_path / "odd.exr", lambda table: table, **provenance)
    (key,) = provenance
    assert f"its header's {key} is invalid" in refused("check", path, scan, *PICTURE, *QUICK)


def test_a_table_that_is_no_number(refused, baked, scan, tmp_path):
    table, record = atlas.read(baked)
    image, layout = atlas.pack(table)
    image[-9, 9] = np.nan
    atlas.write_together({tmp_path / "nan.exr": (image, layout)}, record)
    assert "not numbers" in refused("check", tmp_path / "nan.exr", scan, *PICTURE, *QUICK)


@pytest.mark.parametrize("option", [
    ("--delta-e", "0"), ("--groups", "0"), ("--pairs", "-1"), ("--step-nm", "0"), ("--step-nm", "nan"),
])  # fmt: skip
def test_numbers_that_are_none(refused, baked, scan, option):
    assert option[0] in refused("check", baked, scan, *PICTURE, *QUICK, *option, status=2)
