# SPDX-License-Identifier: GPL-3.0-or-later
import hashlib
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from precompute.bake import make
from precompute.cli import parser
from precompute.measure.errors import Errors, measure
from precompute.measure.truths import truths
from precompute.surface.readers.registry import read_height_map
from precompute.surface.relief import prepare
from precompute.table import atlas, atlas_file
from precompute.table.atlas_file import read_header
from precompute.table.table import Table
from precompute.table.tiling import TILE_PADDING

PICTURE = ("--size-um", "4", "--height-nm", "250")
# Of the 4 um picture: a small table.
SHORT = ("--coherence-um", "4")


@pytest.fixture
def scan(tmp_path):
    """A grey picture of an irregular grating, 48 x 48 pixels, in a folder of its own."""
    folder = tmp_path / "scans"
    folder.mkdir()
    x, y = np.meshgrid(*[np.arange(48) / 48] * 2)
    grey = 127 + 90 * np.sin(2 * np.pi * 5 * x + np.sin(2 * np.pi * y)) + 30 * np.cos(2 * np.pi * 3 * y)
    Image.fromarray(grey.astype(np.uint8)).save(folder / "skin.png")
    return folder / "skin.png"


@pytest.fixture
def run(capsys):
    """Run a command line: (status, standard output, standard error)."""

    def run_line(*argv):
        capsys.readouterr()
        try:
            status = parser.main([str(each) for each in argv])
        except SystemExit as end:
            status = end.code
        return status, *capsys.readouterr()

    return run_line


@pytest.fixture
def refused(run, tmp_path):
    """Run a command line that must fail: status, nothing on standard output, one line of error, nothing written."""

    def run_line(*argv, status=1):
        before = contents(tmp_path)
        got, out, err = run(*argv)
        assert got == status
        assert out == ""
        assert err.startswith("error: ") and err.endswith("\n")
        assert len(err.splitlines()) == 1, err
        assert contents(tmp_path) == before
        # What is wrong, and what to do about it.
        assert "; " in err
        return err

    return run_line


def contents(folder):
    """Its files; an empty folder more is no harm."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def small_bake(tmp_path):
    """The file of a bake of 4 tiles of 256 texels, each of one colour."""
    tiles = np.ones((4, 256, 256, 3), np.float32) * np.array([4, 3, 2, 1])[:, None, None, None]
    table = Table(tiles, np.full((512, 3), 0.5), 0.05, 4 / 252, "D65")
    (tmp_path / "bakes").mkdir()
    path = tmp_path / "bakes" / "small.exr"
    atlas_file.write(path, *atlas.pack(table), {"source": "small"})
    return path


# info


def test_info_prints_what_it_found(run):
    status, out, err = run("info", "sample:sinusoidal")
    assert (status, err) == (0, "")
    assert "rows: 832" in out.splitlines()


def test_info_as_json(run, scan):
    status, out, err = run("info", scan, *PICTURE, "--json", "-")
    assert (status, err) == (0, "")
    facts = json.loads(out)
    assert set(facts) == {
        "rows", "cols", "pixel_size_m", "height_range_m", "height_rms_m", "periods_m", "period_angles_deg", "channels"
    }  # fmt: skip
    assert (facts["rows"], facts["cols"]) == (48, 48)
    assert facts["periods_m"][0] == pytest.approx(0.8e-6, rel=0.1)


def test_info_to_a_file(run, scan, tmp_path):
    status, out, _ = run("info", scan, *PICTURE, "--json", tmp_path / "facts.json")
    assert status == 0 and "rows: 48" in out
    assert json.loads((tmp_path / "facts.json").read_text())["rows"] == 48


# bake


@pytest.fixture
def baked(run, scan, tmp_path):
    """The facts of a bake of the picture, and the folder that it went to."""
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
    assert record["source"] == "skin.png"
    assert record["model"] == "ensemble"
    assert record["coherence_um"] == pytest.approx(facts["coherence_um"])
    # As read: 4 um, 30 areas of 2 (l / 4)^2.
    assert facts["coherence_um"] == pytest.approx(4 * 4 / 60**0.5, rel=1e-6)
    heights = read_height_map(str(scan), 4, 250).height_m
    assert record["heights_sha256"] == [hashlib.sha256(heights.tobytes()).hexdigest()]
    assert record["shape"] == [48, 48]


def test_the_error_in_the_header_is_that_of_the_file(baked, scan):
    """Recomputed from the two files, on other pairs than the bake's own: within the budget."""
    _, folder = baked
    table, record = atlas_file.read(folder / "skin.exr")
    relief = prepare(read_height_map(str(scan), 4, 250))
    truth = truths(relief, table.sigma_b, 2, 500, 5e-9, seed=99)
    errors = measure(truth, table.candidate)
    assert errors.p99 <= 3
    # Both are samples of one distribution.
    assert errors.mean == pytest.approx(record["delta_e"]["mean"], rel=1)


def test_bake_again_gives_the_same_file(baked, run, scan):
    """But for the order in which a matrix product is summed up: a half float may round the other way, 2^-10 of it."""
    _, folder = baked
    (table, record), path = atlas_file.read(folder / "skin.exr"), folder / "skin.exr"
    assert run("bake", scan, *PICTURE, "-o", folder, "--delta-e", "3", "--no-cache")[0] == 0
    again, again_record = atlas_file.read(path)
    np.testing.assert_allclose(again.terms, table.terms, rtol=2**-10, atol=1e-6 * np.abs(table.terms).max())
    assert again_record.pop("delta_e") == pytest.approx(record.pop("delta_e"), rel=1e-3)
    assert again_record == record
    assert sorted(each.name for each in folder.iterdir()) == ["skin.exr", "skin.lobes.exr"]


def test_bake_takes_its_options(run, scan, tmp_path):
    options = ("--delta-e", "5", *SHORT, "--illuminant", "E")
    status, out, _ = run("bake", scan, *PICTURE, "-o", tmp_path, *options, "--json", tmp_path / "facts.json")
    assert status == 0
    assert "skin.exr" in out and "dE00" in out
    facts = json.loads((tmp_path / "facts.json").read_text())
    assert facts["coherence_um"] == pytest.approx(4)
    assert atlas_file.read(tmp_path / "skin.exr")[0].illuminant == "E"


def test_a_mirror_under_a_short_coherence_bakes(run, tmp_path):
    """The least table that there is: two empty tiles of 256."""
    black = tmp_path / "mirror.png"
    Image.fromarray(np.zeros((16, 16), np.uint8)).save(black)
    status, out, _ = run("bake", black, "--size-um", "2", "--height-nm", "100", "-o", tmp_path, "--json", "-")
    assert status == 0
    assert json.loads(out)["delta_e"]["max"] == 0
    assert not atlas_file.read(tmp_path / "mirror.exr")[0].terms.any()


def test_progress_as_json_lines(run, scan, tmp_path):
    _, out, err = run(
        "bake", scan, *PICTURE, "-o", tmp_path, "--delta-e", "5", *SHORT, "--progress", "json", "--json", "-"
    )
    json.loads(out)
    steps = [json.loads(line) for line in err.splitlines()]
    stages = list(dict.fromkeys(step["stage"] for step in steps))
    assert stages == ["transforms", "wavelengths", "self-check"]
    for stage in stages:
        fractions = [step["fraction"] for step in steps if step["stage"] == stage]
        assert fractions == sorted(fractions) and fractions[-1] == 1


def test_progress_as_text(run, scan, tmp_path):
    _, _, err = run("map", scan, *PICTURE, *SHORT, "-o", tmp_path / "map.png", "--size", "16")
    assert err.splitlines()[-1] == "wavelengths: 100%"


def test_a_bake_that_misses_its_budget_is_not_written(refused, scan, tmp_path, monkeypatch):
    poor = Errors(1, 2, 7.31, 9, 0, 0, 0, 10)
    monkeypatch.setattr(make, "self_check", lambda *_: poor)
    told = refused("bake", scan, *PICTURE, "-o", tmp_path / "bakes", "--delta-e", "5", *SHORT, "--progress", "none")
    assert "7.31" in told and "--delta-e 7.7" in told


def test_several_scans_and_a_region(run, scan, tmp_path):
    """One table of two scans; its header names both, the region, and the hash of each."""
    other = tmp_path / "other.png"
    other.write_bytes(scan.read_bytes())
    needs = tmp_path / "needs.json"
    needs.write_text('{"format": 1, "u": [-0.5, 0.5], "v": [-0.2, 0.2], "w": [1, 2]}')
    options = (*PICTURE, *SHORT, "--delta-e", "5", "--needs", needs)
    status, out, _ = run("bake", scan, other, *options, "-o", tmp_path / "bakes", "--json", "-", "--progress", "none")
    assert status == 0
    facts = json.loads(out)
    assert facts["files"][0] == str(tmp_path / "bakes" / "skin_and_1_more.exr")
    layout, record = read_header(Path(facts["files"][0]))
    assert record["source"] == "skin.png, other.png" and len(record["heights_sha256"]) == 2
    assert record["needs"]["u"] == [-0.5, 0.5]
    assert layout.tile_rows < layout.tile_columns and (layout.w_min, layout.w_max) == (1, 2)
    needs.write_text("{}")
    status, _, err = run("bake", scan, *options, "-o", tmp_path / "bakes")
    assert status == 1 and "needs.json" in err.splitlines()[-1]


# map


def test_map_of_a_mirror_is_colourless(run, tmp_path):
    """Half floats of XYZ are right to 2^-12, RGB to 3.2 times that, sRGB's slope (1 / 2.4) makes a third of a 255th
    of it: at most a rounding of one code value, from the exact spectrum too."""
    for method in ("bake", "reference"):
        path = tmp_path / f"{method}.png"
        options = ("--size", "64", "--method", method, "--step-nm", "50", "--progress", "none")
        status, out, err = run("map", "sample:flat", "-o", path, *options)
        assert (status, out, err) == (0, f"{path}\n", "")
        shown = np.asarray(Image.open(path)).astype(int)
        assert shown.shape == (64, 64, 3)
        assert np.ptp(shown, axis=-1).max() <= 1
        assert shown[32, 32].min() >= 250
        assert shown[32, 10].max() <= 1


def test_map_of_a_grating_is_coloured_on_both_sides(run, scan, tmp_path):
    """800 nm along T: first orders of green at +-0.69, blue inside of red."""
    path = tmp_path / "deep" / "map.png"
    assert run("map", scan, *PICTURE, *SHORT, "-o", path, "--size", "96", "--json", "-")[0] == 0
    shown = np.asarray(Image.open(path)).astype(int)
    middle = shown[40:56]
    at = {x: middle[:, round((x + 1) * 48)].mean(axis=0) for x in (-0.85, -0.57, 0.57, 0.85)}
    for side in (-1, 1):
        assert at[side * 0.57][2] > at[side * 0.57][0]
        assert at[side * 0.85][0] > at[side * 0.85][2]


def test_maps_by_either_method_agree(run, scan, tmp_path):
    """In code values of the picture, whose exposure is a percentile of each: a mean below 2, a bake's budget of 1 being
    about 2.5 code values."""
    shown = []
    for method in ("bake", "reference"):
        path = tmp_path / f"{method}.png"
        options = ("--size", "48", "--theta-i", "-20", "--method", method, "--step-nm", "10")
        assert run("map", scan, *PICTURE, *SHORT, "-o", path, *options)[0] == 0
        shown.append(np.asarray(Image.open(path)).astype(int))
    assert np.abs(shown[0] - shown[1]).mean() < 2


@pytest.mark.parametrize("which", ["file", "folder"])
def test_map_of_a_bake(run, small_bake, tmp_path, which):
    path = tmp_path / "map.exr"
    source = small_bake if which == "file" else small_bake.parent
    status, out, _ = run("map", source, "-o", path, "--size", "32", "--json", "-")
    assert status == 0
    assert json.loads(out) == {"files": [str(path)]}
    pixels = OpenEXR.File(str(path)).channels()["RGB"].pixels
    assert pixels.shape == (32, 32, 3) and pixels.dtype == np.float32
    assert np.isfinite(pixels).all() and pixels.max() > 0
    assert sorted(each.name for each in tmp_path.iterdir()) == ["bakes", "map.exr"]


def test_row_zero_of_an_exr_map_is_plus_y(run, tmp_path):
    """A table that is bright for v > 0 only: the upper rows."""
    tiles = np.zeros((1, 256, 256, 3), np.float32)
    tiles[:, 140:] = 1
    table = Table(tiles, np.zeros((256, 3)), 0.05, 4 / 252, "D65")
    atlas_file.write(tmp_path / "up.exr", *atlas.pack(table), {})
    for name in ("map.png", "map_linear.exr"):
        assert run("map", tmp_path / "up.exr", "-o", tmp_path / name, "--size", "32")[0] == 0
    linear = OpenEXR.File(str(tmp_path / "map_linear.exr")).channels()["RGB"].pixels
    assert linear[:12].max() > 0 and linear[17:].max() == 0
    shown = np.asarray(Image.open(tmp_path / "map.png"))
    assert shown[8, 16].min() > 50 and shown[24, 16].max() == 0


# What is refused: one line, a status, and nothing written


def faulty(tmp_path, kind):
    """A path of the kind, and what its line says."""
    path = tmp_path / {"empty": "empty", "short": "short", "text": "text"}.get(kind.split(".")[0], kind)
    path = path.with_suffix("." + kind.split(".")[-1])
    begins = {"nid": b"[DataSet]\r\nVersion=2\r\nGroupCount=2\r\n", "gwy": b"GWYPGwyContainer\0\xff\xff\0\0"}
    begins["png"] = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x10"
    content = {"empty": b"", "short": begins[path.suffix[1:]], "text": b"hello, this is a text\n" * 9}
    path.write_bytes(content[kind.split(".")[0]])
    return path


def lines_of(verb, file, tmp_path, *options):
    output = {"info": [], "bake": ["-o", tmp_path / "out"], "map": ["-o", tmp_path / "out.png"]}[verb]
    return [verb, file, *output, *options]


VERBS = ("info", "bake", "map")


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("content", ["empty", "short", "text"])
@pytest.mark.parametrize("extension", ["nid", "gwy", "png"])
def test_damaged_files(refused, tmp_path, verb, content, extension):
    file = faulty(tmp_path, f"{content}.{extension}")
    sizes = PICTURE if extension == "png" else ()
    assert str(file) in refused(*lines_of(verb, file, tmp_path, *sizes))


@pytest.mark.parametrize("verb", VERBS)
def test_a_truncated_instrument_file(refused, tmp_path, shared_data, verb):
    whole = (shared_data / "nanosurf" / "grid.nid").read_bytes()
    file = tmp_path / "cut.nid"
    file.write_bytes(whole[: len(whole) // 2])
    assert "truncated" in refused(*lines_of(verb, file, tmp_path))


@pytest.mark.parametrize("verb", VERBS)
def test_pictures_without_their_sizes(refused, scan, tmp_path, verb):
    assert "--size-um" in refused(*lines_of(verb, scan, tmp_path))
    assert "--size-um" in refused(*lines_of(verb, scan, tmp_path, "--height-nm", "250"))
    assert "--height-nm" in refused(*lines_of(verb, scan, tmp_path, "--size-um", "4"))


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("size", ["0", "-4", "nan", "inf", "1e99"])
def test_sizes_that_are_none(refused, scan, tmp_path, verb, size):
    refused(*lines_of(verb, scan, tmp_path, "--size-um", size, "--height-nm", "250"))
    refused(*lines_of(verb, scan, tmp_path, "--size-um", "4", "--height-nm", size))


@pytest.mark.parametrize("verb", VERBS)
def test_what_is_no_file(refused, tmp_path, verb):
    folder = tmp_path / "folder"
    folder.mkdir()
    assert "directory" in refused(*lines_of(verb, folder, tmp_path))
    assert "missing.png" in refused(*lines_of(verb, tmp_path / "missing.png", tmp_path, *PICTURE))
    assert "choose one of flat" in refused(*lines_of(verb, "sample:nacre", tmp_path))
    assert "--size-um" in refused(*lines_of(verb, "sample:flat", tmp_path, "--size-um", "65"))
    assert "--channel" in refused(*lines_of(verb, "sample:flat", tmp_path, "--channel", "height"))


@pytest.mark.parametrize("argv", [
    [], ["grate", "sample:flat"], ["info"], ["info", "sample:flat", "--surplus"], ["info", "sample:flat", "--json"],
    ["info", "sample:flat", "--size-um", "wide"], ["bake", "sample:flat"], ["map", "sample:flat"],
    ["bake", "sample:flat", "-o", "out", "--delta-e", "small"],
    ["bake", "sample:flat", "-o", "out", "--illuminant", "candle"],
    *[["bake", "sample:flat", "-o", "out", "--coherence-um", bad] for bad in ("0", "-3", "nan", "inf", "1e9", "long")],
    ["map", "sample:flat", "-o", "out.png", "--method", "guess"],
    ["map", "sample:flat", "-o", "out.png", "--theta-i", "steep"],
    ["map", "sample:flat", "-o", "out.png", "--size", "8.5"],
    ["map", "sample:flat", "-o", "out.png", "--coherence-um", "0"],
])  # fmt: skip
def test_command_lines_that_are_none(refused, tmp_path, monkeypatch, argv):
    monkeypatch.chdir(tmp_path)
    refused(*argv, status=2)


@pytest.mark.parametrize("delta_e", ["0", "-1", "nan", "inf"])
def test_budgets_that_are_none(refused, scan, tmp_path, delta_e):
    told = refused("bake", scan, *PICTURE, *SHORT, "-o", tmp_path / "out", "--delta-e", delta_e)
    assert "--delta-e" in told


@pytest.mark.parametrize("options", [
    ["--theta-i", "90"], ["--theta-i", "-120"], ["--theta-i", "nan"], ["--size", "4"], ["--size", "100000"],
    ["--size", "-64"], ["--step-nm", "0"], ["--step-nm", "-5"], ["--step-nm", "nan"], ["--step-nm", "1000"],
])  # fmt: skip
def test_map_options_that_are_none(refused, scan, tmp_path, options):
    assert options[0] in refused("map", scan, *PICTURE, "-o", tmp_path / "out.png", *options)


@pytest.mark.parametrize("name", ["out.jpg", "out", "out.png.txt"])
def test_pictures_that_are_not_written(refused, scan, tmp_path, name):
    assert name in refused("map", scan, *PICTURE, "-o", tmp_path / name)


def test_a_coherence_that_no_table_holds(refused, scan, tmp_path):
    assert "at most" in refused("bake", scan, *PICTURE, "-o", tmp_path / "out", "--coherence-um", "900")


def test_an_output_folder_that_is_a_file(refused, scan, tmp_path):
    """Said before the work is done, and in one line."""
    (tmp_path / "taken").write_text("mine")
    assert "taken" in refused("bake", scan, *PICTURE, *SHORT, "--delta-e", "5", "-o", tmp_path / "taken")
    assert "taken" in refused("bake", scan, *PICTURE, *SHORT, "--delta-e", "5", "-o", tmp_path / "taken" / "deeper")


def test_an_output_picture_that_is_a_folder_or_in_a_file(refused, scan, tmp_path):
    (tmp_path / "taken").write_text("mine")
    (tmp_path / "folder.png").mkdir()
    for name in ("taken/out.png", "folder.png"):
        refused("map", scan, *PICTURE, *SHORT, "--size", "16", "-o", tmp_path / name)


@pytest.mark.parametrize("verb", VERBS)
def test_a_json_file_that_cannot_be(refused, scan, tmp_path, verb):
    """An error means that nothing was written, the bake included."""
    for target in (tmp_path, tmp_path / "no" / "such" / "facts.json"):
        quick = {"info": (), "bake": (*SHORT, "--delta-e", "5"), "map": (*SHORT, "--size", "16")}[verb]
        refused(*lines_of(verb, scan, tmp_path, *PICTURE, *quick, "--progress", "none", "--json", target))


def test_a_name_that_is_too_long_for_a_bake(refused, scan, tmp_path):
    """255 bytes are what file systems take: the writer's own error type is no OSError."""
    long = scan.with_name("s" * 245 + ".png")
    scan.rename(long)
    refused("bake", long, *PICTURE, *SHORT, "--delta-e", "5", "-o", tmp_path / "out", "--progress", "none")


def test_bakes_that_are_none(refused, small_bake, tmp_path):
    out = tmp_path / "map.png"
    assert "height map" in refused("map", small_bake, "-o", out, "--method", "reference")
    assert "no such file" in refused("map", tmp_path / "missing.exr", "-o", out)
    shutil.copy(small_bake, small_bake.with_name("other.exr"))
    assert "holds 2 bakes" in refused("map", small_bake.parent, "-o", out)
    for name, content in (("empty", b""), ("text", b"hello\n")):
        file = tmp_path / f"{name}.exr"
        file.write_bytes(content)
        assert str(file) in refused("map", file, "-o", out)


@pytest.mark.parametrize("share", [0.02, 0.5, 0.95])
def test_a_truncated_bake(run, small_bake, tmp_path, share):
    """Not by way of `refused`: OpenEXR itself warns on standard output."""
    whole = small_bake.read_bytes()
    small_bake.write_bytes(whole[: int(share * len(whole))])
    status, _, err = run("map", small_bake, "-o", tmp_path / "map.png")
    assert status == 1
    assert err.startswith(f"error: {small_bake}: ") and len(err.splitlines()) == 1
    assert not (tmp_path / "map.png").exists()


@pytest.mark.parametrize(("fault", "status"), [
    (KeyboardInterrupt(), 130), (MemoryError(), 1), (PermissionError(13, "Permission denied", "/some/place"), 1),
    (OSError("encoder error -2"), 1),
])  # fmt: skip
def test_what_stops_a_run(refused, scan, tmp_path, monkeypatch, fault, status):
    def stop(*_, **__):
        raise fault

    monkeypatch.setattr(make, "plan", stop)
    told = refused("bake", scan, *PICTURE, "-o", tmp_path / "out", status=status)
    assert "None" not in told


# The module


def test_the_module_runs_as_a_program(scan, tmp_path):
    root = Path(__file__).resolve().parents[3]

    def program(*argv):
        command = [sys.executable, "-m", "precompute", *map(str, argv)]
        return subprocess.run(command, cwd=root, capture_output=True, text=True)

    good = program("info", scan, *PICTURE, "--json", "-")
    assert good.returncode == 0 and json.loads(good.stdout)["rows"] == 48 and good.stderr == ""
    bad = program("info", tmp_path / "missing.nid")
    assert bad.returncode == 1 and bad.stdout == ""
    assert bad.stderr.startswith("error: ") and len(bad.stderr.splitlines()) == 1


@pytest.mark.parametrize("argv", [["--help"], ["info", "--help"], ["bake", "--help"], ["map", "--help"]])
def test_help_is_told(run, argv):
    status, out, err = run(*argv)
    assert (status, err) == (0, "")
    assert out.startswith("usage: grating")
