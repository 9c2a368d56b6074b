# SPDX-License-Identifier: GPL-3.0-or-later
"""The shipped presets, and the reader of their files."""

import json
from dataclasses import replace

import pytest

from precompute.bake.make import bake_to_folder
from precompute.bake.request import request_from
from precompute.base.failure import GratingError
from precompute.presets.presets import FOLDER, hologram_from, preset_names, read_preset
from precompute.surface.generated.parameters import canonical
from precompute.table.atlas import read_header

NAMES = preset_names()
WORKING = {
    "title": "Foil",
    "request": {"scans": [{"source": "grating:binary?period_um=1"}], "matter": "gold"},
    "base_color": [0.1, 0.2, 0.3],
    "base_roughness": 0.5,
    "sources": ["chosen by eye"],
}


def write(folder, record):
    (folder / "foil.json").write_text(record if isinstance(record, str) else json.dumps(record), encoding="utf-8")
    return read_preset("foil", folder)


def test_there_are_the_presets_that_the_pages_promise():
    assert NAMES == (
        "bluray", "brushed_aluminium", "cd", "corn_snake", "dvd", "gold_foil", "jewel_beetle", "mother_of_pearl",
        "peacock_spider", "record", "security_hologram", "silver_foil", "sunbeam_snake",
    )  # fmt: skip


@pytest.mark.short("[cd", "gold_foil", "jewel_beetle", "security_hologram", "sunbeam_snake")
@pytest.mark.parametrize("name", NAMES)
def test_each_is_read_and_its_request_returns_from_a_header(name):
    preset = read_preset(name)
    assert request_from(preset.request.as_dict(), name) == preset.request
    assert [canonical(scan.source) for scan in preset.request.scans] == [scan.source for scan in preset.request.scans]
    assert preset.name == name and preset.sources
    for scan in preset.request.scans:
        assert scan.read().rows


def test_titles_and_reliefs_differ():
    """Presets with one relief would have one name for the files of their bakes."""
    presets = [read_preset(name) for name in NAMES]
    assert len({preset.title for preset in presets}) == len(NAMES)
    assert len({preset.request.scans[0].source for preset in presets}) == len(NAMES)


def test_a_file_in_the_folder_is_a_preset(tmp_path):
    preset = write(tmp_path, WORKING)
    assert preset_names(tmp_path) == ("foil",)
    assert preset.request.scans[0].source == "grating:binary?period_um=1&depth_nm=140&duty=0.5"
    assert (preset.base_color, preset.base_roughness, preset.direction) == ((0.1, 0.2, 0.3), 0.5, "stored")
    assert str(preset.request.matter) == "gold" and not preset.inputs and preset.hologram is None


def test_a_hologram_is_read_as_it_is_written(tmp_path):
    record = {"pattern": "crystal", "inputs": {"Shards": 8.0, "Turn": 0.5}}
    hologram = write(tmp_path, WORKING | {"hologram": record}).hologram
    assert hologram.as_dict() == record and hologram_from(hologram.as_dict(), "foil") == hologram
    assert write(tmp_path, WORKING | {"hologram": {"pattern": "sunburst"}}).hologram.inputs == {}
    foils = {name: read_preset(name).hologram for name in ("security_hologram", "silver_foil", "gold_foil")}
    assert [foil and foil.pattern for foil in foils.values()] == ["dot_matrix", "crystal", None]


def scan(source):
    return WORKING | {"request": {"scans": [{"source": source}]}}


def hologram(**record):
    return WORKING | {"hologram": {"pattern": "crystal"} | record}


FAULTS = [
    ("{", "foil.json: not JSON"),
    ([1], "foil.json: holds no preset; give an object with title"),
    (WORKING | {"colour": 1}, "foil.json: colour: no such key of a preset; there are title"),
    ({k: v for k, v in WORKING.items() if k != "sources"}, "foil.json: sources: is missing; add `sources`"),
    (WORKING | {"title": "a\nb"}, r"foil.json: title: cannot be 'a\nb'; give a text"),
    (WORKING | {"request": []}, "foil.json: request: has no request"),
    (WORKING | {"request": {}}, "foil.json: request: names no scan; add"),
    (WORKING | {"request": WORKING["request"] | {"matter": "cheese"}}, "foil.json: request: matter: cheese: is not"),
    (scan("skin.nid"), "foil.json: request: skin.nid is a file; give sample:NAME"),
    (scan("sample:toad"), "foil.json: request: there is no sample toad; choose"),
    (scan("grating:wavy"), "foil.json: request: grating:wavy: there is no such kind"),
    (WORKING | {"base_color": [0.1, 0.2]}, r"foil.json: base_color: cannot be [0.1, 0.2]; give red"),
    (WORKING | {"base_color": [0.1, 0.2, 7]}, "foil.json: base_color: cannot be 7; give a number from 0 to 1"),
    (WORKING | {"base_roughness": True}, "foil.json: base_roughness: cannot be True; give a number"),
    (WORKING | {"direction": "up"}, "foil.json: direction: cannot be 'up'; give one of stored, radial"),
    (WORKING | {"direction": ["up"]}, "foil.json: direction: cannot be ['up']; give one of stored, radial"),
    (WORKING | {"inputs": [1]}, "foil.json: inputs: cannot be [1]; give an object"),
    (WORKING | {"inputs": {"Gloss": 1}}, "foil.json: inputs: Gloss: no such input; there are"),
    (WORKING | {"inputs": {"Roughness": 2}}, "foil.json: inputs: Roughness: cannot be 2; give a number from 0 to 1"),
    (WORKING | {"hologram": "crystal"}, "foil.json: hologram: cannot be 'crystal'; give an object with pattern"),
    (hologram(pattern="stars"), "foil.json: hologram: pattern: cannot be 'stars'; give one of dot_matrix, sunburst"),
    (hologram(pattern=["crystal"]), "foil.json: hologram: pattern: cannot be ['crystal']; give one of"),
    (hologram(pattern="picture"), "foil.json: hologram: pattern: cannot be 'picture'; give one of"),
    (hologram(size=3), "foil.json: hologram: size: no such key; there are pattern, inputs"),
    (hologram(inputs={"Cells": 3}), "foil.json: hologram: inputs: Cells: no such input; there are Shards"),
    (hologram(inputs={"Turn": 90}), "foil.json: hologram: inputs: Turn: cannot be 90; give a number from 0 to 1.57"),
    (WORKING | {"sources": []}, "foil.json: sources: names none; say where"),
    (WORKING | {"sources": [""]}, "foil.json: sources: cannot be ''; give lines"),
]


@pytest.mark.parametrize(("record", "line"), FAULTS, ids=[line[:50] for _, line in FAULTS])
def test_each_fault_is_one_line_with_the_file_the_fault_and_the_remedy(tmp_path, record, line):
    with pytest.raises(GratingError) as told:
        write(tmp_path, record)
    assert line in str(told.value)
    assert str(told.value).isprintable() and "; " in str(told.value)


def test_an_unknown_name_is_one_line(tmp_path):
    with pytest.raises(GratingError, match="^preset toad: there is no such preset; choose one of bluray, "):
        read_preset("toad")
    with pytest.raises(GratingError, match="there is no such preset"):
        read_preset("../presets/cd")


def test_a_path_that_ends_in_json_is_a_file_anywhere(tmp_path):
    (tmp_path / "mine.json").write_text((FOLDER / "cd.json").read_text())
    assert read_preset(str(tmp_path / "mine.json")) == replace(read_preset("cd"), name="mine")
    with pytest.raises(GratingError, match="nowhere.json: cannot be read .*; compare it with a preset that works"):
        read_preset(str(tmp_path / "nowhere.json"))


@pytest.mark.night("tests/precompute/cli/test_matters.py")
@pytest.mark.parametrize("name", ["gold_foil", "jewel_beetle", "record"])
def test_it_bakes(name, tmp_path):
    """A metal, a stack of layers, and the coarsest groove."""
    request = replace(read_preset(name).request, delta_e=3.0, coherence_length_m=4e-6)
    facts = bake_to_folder([scan.read() for scan in request.scans], request, tmp_path)
    assert facts["delta_e"]["p99"] <= 3
    _, header = read_header(tmp_path / next(name for name in facts["files"] if name.endswith(".exr")))
    assert request_from(header["request"], name) == request


def test_the_files_end_with_a_newline_and_hold_no_tab():
    for name in NAMES:
        text = (FOLDER / f"{name}.json").read_text(encoding="utf-8")
        assert text.endswith("}\n") and "\t" not in text
