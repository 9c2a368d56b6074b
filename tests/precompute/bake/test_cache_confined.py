# SPDX-License-Identifier: GPL-3.0-or-later
"""Forged cache entries: they cannot lead out of their folder, and are baked again."""

import errno
import hashlib
import json
import os
import shutil

import pytest

from precompute.bake import cache, ensemble
from precompute.bake.make import are_facts
from precompute.base.failure import GratingError
from precompute.surface.readers.reader_registry import read_height_map

from .conftest import SKIN, assert_nothing_is_left, bake_once, fake, key, names, never


def entry_of(cache_folder, record, files=(("a.exr", b"evil"),)):
    """Make an entry of key 1 by hand. `record` is text, or data that is written as JSON."""
    entry = cache_folder / "entries" / key(1)
    (entry / "files").mkdir(parents=True)
    for name, content in files:
        (entry / "files" / name).write_bytes(content)
    (entry / "record.json").write_text(record if isinstance(record, str) else json.dumps(record))
    return entry


def told(content):
    """A record's data about a file."""
    return {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}


@pytest.mark.parametrize("name", [
    "../../EVIL.exr", "../EVIL.exr", "{outside}/EVIL.exr", "files/EVIL.exr", "./a.exr", "..", ".", "", "a.py", "a.exr/",
    "a\0.exr", "b.exr",
])  # fmt: skip
def test_a_record_names_no_file_but_the_bake_s_own(tmp_path, cache_folder, name):
    """The file exists as recorded; only its name is wrong. The last name is plain, but of another bake."""
    name = name.format(outside=tmp_path / "outside")
    entry = entry_of(cache_folder, {"facts": {"seconds": 1.0}, "files": {name: told(b"evil")}})
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside" / "EVIL.exr").write_bytes(b"evil")
    for folder in (entry / "files", entry, entry.parent, cache_folder):
        (folder / "EVIL.exr").write_bytes(b"evil")
    (entry / "files" / "b.exr").write_bytes(b"evil")
    before = set(tmp_path.rglob("*"))
    output = tmp_path / "one" / "two" / "three"
    assert bake_once(key(1), output, fake())["cached"] is False
    made = set(tmp_path.rglob("*")) - before
    assert made == {output.parent.parent, output.parent, output, output / "a.exr"}
    assert (output / "a.exr").read_bytes() == b"table"


@pytest.mark.parametrize("record", [
    "[]", "null", "true", "1", "{}", '{"facts": {}}', '{"files": {}}', '{"facts": [], "files": []}', "[" * 100_000,
    '{"facts": ' * 100_000, '{"facts": {"seconds": ' + "9" * 5000 + '}, "files": {}}', '{"facts": {}, "files": true}',
    '{"facts": {"seconds": NaN}, "files": {"a.exr": {}}}', '{"facts": {}, "files": {"a.exr": true}}',
    '{"facts": {}, "files": {"a.exr": {"bytes": true, "sha256": 0}}}', '{"facts": "files", "files": "facts"}',
    '{"facts": {}, "files": ["a.exr"]}', '{"facts": {}, "files": [["a.exr", {}]]}', "\0",
])  # fmt: skip
def test_a_record_of_another_kind_is_damage(tmp_path, cache_folder, record):
    entry_of(cache_folder, record)
    calls = []
    assert bake_once(key(1), tmp_path / "out", fake(calls=calls))["cached"] is False
    assert calls == [[]]
    assert bake_once(key(1), tmp_path / "out", never)["cached"] is True
    assert_nothing_is_left(cache_folder, tmp_path / "out")


def test_facts_of_wrong_types_are_damage(run_bake, picture, tmp_path, cache_folder):
    run_bake(tmp_path / "first")
    (record,) = cache_folder.glob("entries/*/record.json")
    whole = json.loads(record.read_text())
    scan = [read_height_map(str(picture), 2, 60)]
    facts = whole["facts"] | {"files": SKIN}
    assert are_facts(facts, scan) and are_facts(facts | {"files": SKIN[:1]}, scan)
    for value in (True, "1", None, [], {}, {"p99": True}, ["x", 2], [1, 2, 3]):
        for fact in (
            "seconds",
            "delta_e",
            "tile",
            "tiles",
            "coherence_um",
            "blender_bytes",
            "check_seconds",
            "files",
        ):
            assert not are_facts(facts | {fact: value}, scan), (fact, value)
    assert not are_facts(facts | {"files": ["other.exr"]}, scan)
    record.write_text(json.dumps(whole | {"facts": whole["facts"] | {"delta_e": {"p99": "<b>"}}}))
    assert run_bake(tmp_path / "second")[0]["cached"] is False
    assert names(tmp_path / "second") == SKIN


def test_the_bake_of_another_request_is_not_taken(run_bake, tmp_path, cache_folder, monkeypatch):
    """It was copied into the place of the wanted one, and its record made one of that key."""
    run_bake(tmp_path / "first")
    (entry,) = cache_folder.glob("entries/*")
    record = json.loads((entry / "record.json").read_text())
    assert cache.key_of(record["of"]) == entry.name and cache.is_of(record["of"], list(entry.glob("files/*")))
    record["of"]["parameters"]["delta_e"] = 6.0
    wanted = shutil.copytree(entry, entry.with_name(cache.key_of(record["of"])))
    (wanted / "record.json").write_text(json.dumps(record))
    monkeypatch.setattr(ensemble, "plan", never)
    with pytest.raises(AssertionError, match="baked again"):
        run_bake(tmp_path / "second", "--delta-e", "6")
    assert run_bake(tmp_path / "third")[0]["cached"] is True


def test_links_in_the_cache_are_not_followed(tmp_path, cache_folder):
    """Links replace an entry's file and the entry in the making."""
    victim = tmp_path / "victim"
    (victim / "files").mkdir(parents=True)
    (victim / "files" / "a.exr").write_bytes(b"mine")
    record = {"facts": {"seconds": 1.0}, "files": {"a.exr": told(b"mine")}}
    entry = entry_of(cache_folder, record, files=())
    (entry / "files" / "a.exr").symlink_to(victim / "files" / "a.exr")
    (cache_folder / "partial").mkdir()
    (cache_folder / "partial" / key(1)).symlink_to(victim)
    assert bake_once(key(1), tmp_path / "out", fake())["cached"] is False
    assert (victim / "files" / "a.exr").read_bytes() == b"mine"
    assert [path.name for path in victim.rglob("*")] == ["files", "a.exr"]
    assert_nothing_is_left(cache_folder, tmp_path / "out")


def test_a_link_in_the_place_of_a_lock_costs_one_line(tmp_path, cache_folder, capsys):
    (cache_folder / "locks").mkdir(parents=True)
    (cache_folder / "locks" / f"{key(1)}.lock").symlink_to(tmp_path / "victim")
    assert bake_once(key(1), tmp_path, fake())["cached"] is False
    assert names(tmp_path) == ["a.exr"]
    assert len(capsys.readouterr().err.splitlines()) == 1


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no fifos")
@pytest.mark.parametrize("where", ["record.json", "files/a.exr"])
def test_a_fifo_in_an_entry_is_not_waited_for(tmp_path, cache_folder, where):
    entry = entry_of(cache_folder, {"facts": {"seconds": 1.0}, "files": {"a.exr": told(b"evil")}})
    (entry / where).unlink()
    os.mkfifo(entry / where)
    assert bake_once(key(1), tmp_path / "out", fake())["cached"] is False


def test_a_full_disk_is_no_damaged_entry(tmp_path, cache_folder, monkeypatch):
    """The entry stays, nothing is baked again, and the error names the full output folder, not the cache."""
    bake_once(key(1), tmp_path / "first", fake())

    opened = cache.Path.open

    def full(path, mode="r", *rest, **more):
        if mode == "wb":
            raise OSError(errno.ENOSPC, "No space left on device", str(path))
        return opened(path, mode, *rest, **more)

    with monkeypatch.context() as patched:
        patched.setattr(cache.Path, "open", full)
        with pytest.raises(GratingError) as caught:
            bake_once(key(1), tmp_path / "out", never)
    place = tmp_path / "out" / "a.exr"
    assert str(caught.value).startswith(f"{place}: cannot be written (No space left on device); ")
    assert not (tmp_path / "out").exists()
    assert bake_once(key(1), tmp_path / "out", never)["cached"] is True


def test_a_folder_that_cannot_be_written_into_is_told_before_the_work(refused, picture, tmp_path, monkeypatch):
    (tmp_path / "taken").write_text("mine")
    monkeypatch.setattr(ensemble, "plan", never)
    monkeypatch.setattr("precompute.cli.parser.check_targets", lambda arguments: None)
    line = refused("bake", picture, "--size-um", "2", "--height-nm", "60", "-o", tmp_path / "taken" / "out")
    assert str(tmp_path / "taken" / "out") in line and "cannot be written" in line
