# SPDX-License-Identifier: GPL-3.0-or-later
"""The cache of bakes: reuse, damaged entries, unusable folders, and the size limit."""

import errno
import json
import os
import shutil
from pathlib import Path

import pytest

from precompute.bake import cache, ensemble
from precompute.base.failure import GratingError
from precompute.cli import bake_verb as bake_verb
from precompute.table.atlas import read_header

from .conftest import SKIN, assert_nothing_is_left, bake_once, fake, key, names, never


@pytest.mark.night("tests/precompute/bake/test_cache_confined.py")
def test_the_second_bake_of_a_surface_is_taken(run_bake, picture, tmp_path, cache_folder, monkeypatch):
    """The scan's folder does not matter, but its name does, because the bake's header holds it."""
    facts, err = run_bake(tmp_path / "first")
    assert facts["cached"] is False and "wavelengths" in err
    moved = tmp_path / "moved" / picture.name
    moved.parent.mkdir()
    shutil.copy(picture, moved)
    renamed = shutil.copy(picture, tmp_path / "scale.png")
    assert run_bake(tmp_path / "renamed", file=renamed)[0]["cached"] is False
    assert read_header(tmp_path / "renamed" / "scale.exr")[1]["source"] == "scale.png"
    monkeypatch.setattr(ensemble, "plan", never)
    again, err = run_bake(tmp_path / "second", file=moved)
    # The scan is only read, for its heights.
    assert [json.loads(line)["stage"] for line in err.splitlines()] == ["reading the scan"]
    assert again.pop("cached") is True
    assert again.pop("files") == [str(tmp_path / "second" / name) for name in SKIN]
    assert again == {fact: value for fact, value in facts.items() if fact not in ("cached", "files")}
    for name in SKIN:
        assert (tmp_path / "second" / name).read_bytes() == (tmp_path / "first" / name).read_bytes()
    assert_nothing_is_left(cache_folder, tmp_path / "second", entries=2)
    with pytest.raises(AssertionError, match="baked again"):
        run_bake(tmp_path / "third", "--no-cache")
    with pytest.raises(AssertionError, match="baked again"):
        run_bake(tmp_path / "third", "--delta-e", "6")


def test_no_cache_leaves_the_folder_alone(run_bake, tmp_path, cache_folder, monkeypatch):
    monkeypatch.setattr(bake_verb, "bake_to_folder", lambda *_, **__: {"seconds": 1.0, "files": ["a.exr"]})
    facts, _ = run_bake(tmp_path, "--no-cache")
    assert facts["cached"] is False
    assert not cache_folder.exists()


@pytest.mark.parametrize("damage", ["cut", "flipped", "gone", "record cut", "record of another", "record gone"])
def test_a_damaged_entry_is_made_anew(tmp_path, cache_folder, damage):
    bake_once(key(1), tmp_path / "first", fake(b"table" * 100))
    entry = cache_folder / "entries" / key(1)
    file, record = entry / "files" / "a.exr", entry / "record.json"
    if damage == "cut":
        file.write_bytes(file.read_bytes()[:250])
    elif damage == "flipped":
        file.write_bytes(b"tablf" + file.read_bytes()[5:])
    elif damage == "record cut":
        record.write_text(record.read_text()[:40])
    elif damage == "record of another":
        record.write_text("[]")
    else:
        (file if damage == "gone" else record).unlink()
    calls = []
    for _ in range(2):
        facts = bake_once(key(1), tmp_path / "out", fake(b"table" * 100, calls))
        assert (tmp_path / "out" / "a.exr").read_bytes() == b"table" * 100
    assert calls == [[]] and facts["cached"] is True
    assert_nothing_is_left(cache_folder, tmp_path / "out")


@pytest.mark.night("tests/precompute/cli/test_level.py")
def test_a_folder_that_cannot_be_costs_one_line(run_bake, tmp_path, monkeypatch):
    """A file takes the place of the cache's folder."""
    taken = tmp_path / "taken"
    taken.write_text("mine")
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE", str(taken / "cache"))
    facts, err = run_bake(tmp_path / "out", "--progress", "none")
    assert facts["cached"] is False
    assert err.startswith("warning: ") and len(err.splitlines()) == 1 and "NATURAL_GRATINGS_CACHE" in err
    assert names(tmp_path / "out") == SKIN


def test_a_cache_whose_path_is_too_long_costs_one_line(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE", str(tmp_path / ("c" * 300)))
    assert bake_once(key(1), tmp_path / "out", fake())["cached"] is False
    assert names(tmp_path / "out") == ["a.exr"]
    err = capsys.readouterr().err
    assert err.startswith("warning: ") and len(err.splitlines()) == 1


def test_no_home_costs_one_line(tmp_path, monkeypatch, capsys):
    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("NATURAL_GRATINGS_CACHE")
    monkeypatch.setattr(Path, "home", homeless)
    assert bake_once(key(1), tmp_path, fake())["cached"] is False
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_a_full_disk_costs_one_line(tmp_path, cache_folder, monkeypatch, capsys):
    def full(source, target):
        raise OSError(errno.ENOSPC, "No space left on device", str(source), None, str(target))  # as shutil does

    monkeypatch.setattr(cache.shutil, "copyfile", full)
    facts = bake_once(key(1), tmp_path / "out", fake())
    assert facts == {"seconds": 2.5, "files": [str(tmp_path / "out" / "a.exr")], "cached": False}
    err = capsys.readouterr().err
    assert "No space left" in err and len(err.splitlines()) == 1
    assert f"({cache_folder}: No space left" in err, "the cache's folder, not a path of 64 letters more in it"
    assert names(cache_folder / "entries") == names(cache_folder / "partial") == []
    assert names(tmp_path / "out") == ["a.exr"]


def test_a_bake_that_fails_leaves_nothing(tmp_path, cache_folder):
    def fail(folder, progress):
        fake()(folder)
        raise GratingError("skin", "misses its budget", "ask for more")

    with pytest.raises(GratingError):
        bake_once(key(1), tmp_path, fail)
    assert names(tmp_path) == names(cache_folder / "entries") == []
    assert bake_once(key(1), tmp_path, fake())["cached"] is False


def test_the_longest_unused_goes_first(tmp_path, cache_folder, monkeypatch):
    """There is room for three entries of 300,000 bytes. The first is used again before the fourth is added."""
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE_MB", "0.95")
    for number in range(3):
        bake_once(key(number), tmp_path, fake(bytes(300_000)))
        os.utime(cache_folder / "entries" / key(number) / "record.json", (1e9 + number, 1e9 + number))
    bake_once(key(0), tmp_path, never)
    bake_once(key(3), tmp_path, fake(bytes(300_000)))
    assert names(cache_folder / "entries") == [key(0), key(2), key(3)]
    assert_nothing_is_left(cache_folder, tmp_path, entries=3)


def test_the_last_one_stays_whatever_its_size(tmp_path, cache_folder, monkeypatch):
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE_MB", "0")
    for number in range(2):
        bake_once(key(number), tmp_path, fake(bytes(5000)))
    assert names(cache_folder / "entries") == [key(1)]
    assert bake_once(key(1), tmp_path, never)["cached"] is True


def test_an_entry_in_use_is_not_evicted(tmp_path, cache_folder, monkeypatch):
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE_MB", "0")
    bake_once(key(1), tmp_path, fake())
    with cache.Cache(cache_folder).hold(key(1)):
        bake_once(key(2), tmp_path, fake())
        assert names(cache_folder / "entries") == [key(1), key(2)]


@pytest.mark.parametrize("text", ["much", "-1", "nan", "inf"])
def test_limits_that_are_none(tmp_path, monkeypatch, text):
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE_MB", text)
    with pytest.raises(GratingError, match="NATURAL_GRATINGS_CACHE_MB .*; "):
        bake_once(key(1), tmp_path, never)


def test_folder_and_limit_when_nothing_is_set(monkeypatch):
    monkeypatch.delenv("NATURAL_GRATINGS_CACHE")
    assert cache.default_folder() == Path.home() / ".cache" / "natural-gratings"
    assert cache.limits_set() == cache.Limits(2 << 30)
