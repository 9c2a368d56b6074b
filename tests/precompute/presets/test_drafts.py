# SPDX-License-Identifier: GPL-3.0-or-later
"""Draft bakes: they are believed only with their own version, request and files."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from precompute.bake.cache import BAKE_VERSION
from precompute.presets import presets
from precompute.presets.presets import preset_names, read_preset

REQUEST = presets.draft_request(read_preset("cd").request)


def bake(folder: Path) -> dict:
    folder.mkdir(parents=True)
    files = [folder / "cd.exr", folder / "cd.lobes.exr"]
    for file in files:
        file.write_bytes(b"a table")
    run = {"seconds": 1.5, "check_seconds": 0.5, "peak_bytes": 1 << 27, "cached": False}
    return {**run, "tiles": 3, "files": [str(file) for file in files]}


@pytest.fixture
def folder(tmp_path):
    presets.write_draft(REQUEST, bake(tmp_path / "cd"))
    return tmp_path


def test_a_draft_is_found_where_it_is_now(folder):
    moved = folder.with_name("moved")
    folder.rename(moved)
    facts = presets.shipped_draft("cd", REQUEST, moved)
    assert facts == {"tiles": 3, "files": [str(moved / "cd" / "cd.exr"), str(moved / "cd" / "cd.lobes.exr")]}


def test_a_draft_has_no_path_of_the_machine_that_made_it(folder):
    assert str(folder) not in (folder / "cd" / "draft.json").read_text()


def test_another_preset_has_none(folder):
    assert presets.shipped_draft("dvd", REQUEST, folder) is None


def test_a_draft_of_another_request_is_refused(folder):
    assert presets.shipped_draft("cd", replace(REQUEST, delta_e=1.0), folder) is None


def test_a_draft_of_another_version_is_refused(folder):
    record = folder / "cd" / "draft.json"
    record.write_text(json.dumps(json.loads(record.read_text()) | {"version": BAKE_VERSION + 1}))
    assert presets.shipped_draft("cd", REQUEST, folder) is None


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"facts": 3}', '{"version": 1, "facts": {"files": 4}}', "\0"])
def test_a_damaged_record_is_no_draft(folder, text):
    (folder / "cd" / "draft.json").write_text(text)
    assert presets.shipped_draft("cd", REQUEST, folder) is None


def test_a_draft_without_its_file_is_none(folder):
    (folder / "cd" / "cd.lobes.exr").unlink()
    assert presets.shipped_draft("cd", REQUEST, folder) is None


def test_a_draft_keeps_all_of_its_preset_but_the_quality():
    for name in preset_names():
        request = read_preset(name).request
        draft = presets.draft_request(request)
        assert replace(draft, delta_e=request.delta_e, coherence_length_m=request.coherence_length_m) == request
