# SPDX-License-Identifier: GPL-3.0-or-later
"""Refusals of the command line: one line of error, a status, and no written file."""

import shutil

import pytest

from laboratory.verbs import VERBS as VERBS_OF_LABORATORY
from precompute.cli import parser

from .conftest import PICTURE, SHORT

VERBS = ("info", "bake", "map")


def faulty(tmp_path, kind):
    """Write a faulty file and return its path; `kind` is its content and extension, for example "empty.nid"."""
    path = tmp_path / {"empty": "empty", "short": "short", "text": "text"}.get(kind.split(".")[0], kind)
    path = path.with_suffix("." + kind.split(".")[-1])
    begins = {"nid": b"[DataSet]\r\nVersion=2\r\nGroupCount=2\r\n", "gwy": b"GWYPGwyContainer\0\xff\xff\0\0"}
    begins["png"] = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x10"
    content = {"empty": b"", "short": begins[path.suffix[1:]], "text": b"hello, this is a text\n" * 9}
    path.write_bytes(content[kind.split(".")[0]])
    return path


def lines_of(verb, file, tmp_path, *options):
    """The command line of a verb for a file, with its output in tmp_path."""
    output = {"info": [], "bake": ["-o", tmp_path / "out"], "map": ["-o", tmp_path / "out.png"]}[verb]
    return [verb, file, *output, *options]


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
    refused(*lines_of(verb, scan, tmp_path, "--size-um", size, "--height-nm", "250"), status=2)
    refused(*lines_of(verb, scan, tmp_path, "--size-um", "4", "--height-nm", size), status=2)


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
    ["bake", "sample:flat", "-o", "out", "--illuminant", "moon"],
    *[["bake", "sample:flat", "-o", "out", "--coherence-um", bad] for bad in ("0", "-3", "nan", "inf", "1e9", "long")],
    ["map", "sample:flat", "-o", "out.png", "--method", "guess"],
    ["map", "sample:flat", "-o", "out.png", "--theta-i", "steep"],
    ["map", "sample:flat", "-o", "out.png", "--size", "8.5"],
    ["map", "sample:flat", "-o", "out.png", "--coherence-um", "0"],
])  # fmt: skip
def test_command_lines_that_are_none(refused, tmp_path, monkeypatch, argv):
    monkeypatch.chdir(tmp_path)
    refused(*argv, status=2)


@pytest.mark.parametrize("delta_e", ["0", "-1", "nan", "inf", "1e-308"])
def test_budgets_that_are_none(refused, scan, tmp_path, delta_e):
    told = refused("bake", scan, *PICTURE, *SHORT, "-o", tmp_path / "out", "--delta-e", delta_e, status=2)
    assert "--delta-e" in told and "give a number from 0.001 to 100" in told


@pytest.mark.parametrize("options", [
    ["--theta-i", "90"], ["--theta-i", "-120"], ["--theta-i", "nan"], ["--size", "4"], ["--size", "100000"],
    ["--size", "-64"], ["--step-nm", "0"], ["--step-nm", "-5"], ["--step-nm", "nan"], ["--step-nm", "1000"],
])  # fmt: skip
def test_map_options_that_are_none(refused, scan, tmp_path, options):
    assert options[0] in refused("map", scan, *PICTURE, "-o", tmp_path / "out.png", *options, status=2)


@pytest.mark.parametrize("name", ["out.jpg", "out", "out.png.txt"])
def test_pictures_that_are_not_written(refused, scan, tmp_path, name):
    assert name in refused("map", scan, *PICTURE, "-o", tmp_path / name)


def test_a_coherence_that_no_table_holds(refused, scan, tmp_path):
    assert "at most" in refused("bake", scan, *PICTURE, "-o", tmp_path / "out", "--coherence-um", "900")


def test_an_output_folder_that_is_a_file(refused, scan, tmp_path):
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
    for target in (tmp_path, tmp_path / "no" / "such" / "facts.json"):
        quick = {"info": (), "bake": (*SHORT, "--delta-e", "5"), "map": (*SHORT, "--size", "16")}[verb]
        refused(*lines_of(verb, scan, tmp_path, *PICTURE, *quick, "--progress", "none", "--json", target))


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
    """The fixture `refused` does not fit, because OpenEXR prints a warning on standard output."""
    whole = small_bake.read_bytes()
    small_bake.write_bytes(whole[: int(share * len(whole))])
    status, _, err = run("map", small_bake, "-o", tmp_path / "map.png")
    assert status == 1
    assert err.startswith(f"error: {small_bake}: ") and len(err.splitlines()) == 1
    assert not (tmp_path / "map.png").exists()


@pytest.mark.parametrize("verb", VERBS_OF_LABORATORY)
def test_a_verb_of_the_laboratory_is_unknown_to_the_product(capsys, verb):
    with pytest.raises(SystemExit):
        parser.main([verb])
    told = capsys.readouterr().err
    assert told.startswith(f"error: argument VERB: invalid choice: '{verb}'") and len(told.splitlines()) == 1
