# SPDX-License-Identifier: GPL-3.0-or-later
"""The cache of bakes: its keys, two processes at once, killed runs, damage, and its limit."""

import errno
import json
import os
import shutil
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from precompute.bake import cache, make
from precompute.bake.request import BakeRequest
from precompute.base.failure import GratingError
from precompute.cli import bake as bake_verb
from precompute.cli import parser
from precompute.cli.bake import request_of
from precompute.cli.parser import build_parser
from precompute.surface.height_map import HeightMap
from precompute.table import atlas_file
from precompute.table.atlas_file import read_header

ROOT = Path(__file__).resolve().parents[3]
OPTIONS = ("--size-um", "2", "--height-nm", "60", "--coherence-um", "2", "--delta-e", "5")
# What a bake of skin.png writes.
SKIN = ["skin.exr", "skin.lobes.exr"]
# `bake_once` with a bake that takes no time, until one function stops the process as a kill does: no clean-up.
STOPPED = """
import os, shutil, sys
from pathlib import Path
from precompute.bake import cache

def make(folder):
    folder.mkdir(parents=True)
    (folder / "a.exr").write_bytes(b"whole" * 1000)
    return {"seconds": 1.0, "files": [str(folder / "a.exr")]}

def half(source, target):
    Path(target).write_bytes(Path(source).read_bytes()[:100])
    os._exit(9)

def at_once(*_):
    os._exit(9)

point = sys.argv[2]
if point == "copy":
    shutil.copyfile = half
elif point == "rename":
    Path.rename = at_once
elif point == "delivery":
    Path.replace = at_once
cache.bake_once("k" * 64, Path(sys.argv[1]), make)
"""


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    """A grey picture of an irregular grating, 24 x 24 pixels."""
    path = tmp_path_factory.mktemp("scan") / "skin.png"
    x, y = np.meshgrid(*[np.arange(24) / 24] * 2)
    grey = 127 + 90 * np.sin(2 * np.pi * 3 * x + np.sin(2 * np.pi * y)) + 30 * np.cos(4 * np.pi * y)
    Image.fromarray(grey.astype(np.uint8)).save(path)
    return path


@pytest.fixture
def bake(scan, capsys):
    """Run `bake` here: its facts and standard error."""

    def run(output, *options, file=scan):
        capsys.readouterr()
        arguments = ["bake", file, *OPTIONS, "-o", output, "--progress", "json", "--json", "-", *options]
        assert parser.main([str(each) for each in arguments]) == 0
        out, err = capsys.readouterr()
        return json.loads(out), err

    return run


class Child:
    """A bake in a process of its own, its outputs in files."""

    def __init__(self, scan: Path, folder: Path, output: Path):
        self.out, self.err = (folder / f"{output.name}.{kind}" for kind in ("out", "err"))
        command = [sys.executable, "-m", "precompute", "bake", scan, *OPTIONS, "-o", output, "--progress", "json"]
        with self.out.open("wb") as out, self.err.open("wb") as err:
            self.process = subprocess.Popen([*map(str, command), "--json", "-"], cwd=ROOT, stdout=out, stderr=err)

    @property
    def stages(self) -> list[str]:
        lines = [line for line in self.err.read_text().splitlines() if line.endswith("}")]
        return list(dict.fromkeys(json.loads(line)["stage"] for line in lines))

    def wait_for(self, stage: str) -> None:
        deadline = time.monotonic() + 60
        while stage not in self.stages:
            assert self.process.poll() is None, self.err.read_text()
            assert time.monotonic() < deadline
            time.sleep(0.01)

    def facts(self) -> dict:
        assert self.process.wait(60) == 0, self.err.read_text()
        return json.loads(self.out.read_text())


def fake(content=b"table", calls=None):
    """A bake that takes no time; `calls` gathers what it found in its folder."""

    def make(folder):
        if calls is not None:
            calls.append(names(folder) if folder.exists() else None)
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "a.exr").write_bytes(content)
        return {"seconds": 2.5, "files": [str(folder / "a.exr")]}

    return make


def never(*_, **__):
    raise AssertionError("baked again")


def key(number):
    return f"{number:064x}"


def names(folder):
    return sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []


def assert_nothing_is_left(cache_folder, output, entries=1):
    """Whole files in the output, whole entries in the cache, and nothing besides."""
    assert names(output) in (["a.exr"], SKIN)
    assert names(cache_folder / "partial") == []
    assert len(names(cache_folder / "entries")) == entries
    for entry in (cache_folder / "entries").iterdir():
        assert names(entry) == ["files", "record.json"]
    if os.name == "posix":
        assert len(names(cache_folder / "locks")) == entries


# Keys


@pytest.fixture
def height_map():
    heights = np.random.default_rng(1).normal(0, 1e-7, (5, 7))
    heights[2, 3] = np.nan
    return HeightMap(heights, (1e-7, 2e-7), "folder/skin.png", "Topography")


def request(*argv):
    arguments = build_parser().parse_args(["bake", "skin.png", "-o", "out", *argv])
    return request_of(arguments)


def test_a_key_is_of_the_content_alone(height_map):
    """Not of the folder, the memory's order, or how the command line spells a number."""
    found = cache.key_of([height_map], request())
    assert len(found) == 64
    assert cache.key_of([replace(height_map, source="other/place/skin.png")], request()) == found
    assert cache.key_of([replace(height_map, height_m=np.asfortranarray(height_map.height_m))], request()) == found
    same = request("--delta-e", "1.00", "--coherence-um", "auto", "--json", "-", "--progress", "none", "--no-cache")
    assert cache.key_of([height_map], same) == found


def test_each_part_of_the_content_changes_the_key(height_map, monkeypatch):
    one_height = height_map.height_m.copy()
    one_height[4, 6] = np.nextafter(one_height[4, 6], 1)
    changed = [
        replace(height_map, height_m=one_height),
        replace(height_map, height_m=height_map.height_m.reshape(7, 5)),
        replace(height_map, pixel_size_m=(1e-7, 2.1e-7)),
        replace(height_map, pixel_size_m=(2e-7, 1e-7)),
        replace(height_map, periodic=True),
        replace(height_map, channel="Amplitude"),
        replace(height_map, source="folder/scale.png"),
        replace(height_map, source="sample:skin.png"),
    ]
    keys = [cache.key_of([each], request()) for each in (height_map, *changed)]
    monkeypatch.setattr(cache, "BAKE_VERSION", cache.BAKE_VERSION + 1)
    keys.append(cache.key_of([height_map], request()))
    monkeypatch.setattr(cache, "FORMAT", atlas_file.FORMAT + 1)
    keys.append(cache.key_of([height_map], request()))
    assert len(set(keys)) == len(keys)


def test_each_option_of_the_bake_changes_the_key(height_map, tmp_path):
    needs = tmp_path / "needs.json"
    needs.write_text('{"format": 1, "u": [0, 1]}')
    lines = [(), ("--delta-e", "1.5"), ("--coherence-um", "30"), ("--illuminant", "E"), ("--needs", str(needs))]
    keys = [cache.key_of([height_map], request(*line)) for line in lines]
    needs.write_text('{"format": 1, "u": [0, 1.5]}')
    keys.append(cache.key_of([height_map], request("--needs", str(needs))))
    keys.append(cache.key_of([height_map, height_map], request()))
    assert len(set(keys)) == len(keys)


# The verb


def test_the_second_bake_of_a_surface_is_taken(bake, scan, tmp_path, cache_folder, monkeypatch):
    """From whatever folder the scan comes; under another name it is baked anew, since the bake tells its name."""
    facts, err = bake(tmp_path / "first")
    assert facts["cached"] is False and "wavelengths" in err
    moved = tmp_path / "moved" / scan.name
    moved.parent.mkdir()
    shutil.copy(scan, moved)
    renamed = shutil.copy(scan, tmp_path / "scale.png")
    assert bake(tmp_path / "renamed", file=renamed)[0]["cached"] is False
    assert read_header(tmp_path / "renamed" / "scale.exr")[1]["source"] == "scale.png"
    monkeypatch.setattr(make, "plan", never)
    again, err = bake(tmp_path / "second", file=moved)
    assert err == ""
    assert again.pop("cached") is True
    assert again.pop("files") == [str(tmp_path / "second" / name) for name in SKIN]
    assert again == {fact: value for fact, value in facts.items() if fact not in ("cached", "files")}
    for name in SKIN:
        assert (tmp_path / "second" / name).read_bytes() == (tmp_path / "first" / name).read_bytes()
    assert_nothing_is_left(cache_folder, tmp_path / "second", entries=2)
    with pytest.raises(AssertionError, match="baked again"):
        bake(tmp_path / "third", BakeRequest(coherence_length_m="--no-cache"))
    with pytest.raises(AssertionError, match="baked again"):
        bake(tmp_path / "third", BakeRequest(delta_e="6", coherence_length_m="--delta-e"))


def test_no_cache_leaves_the_folder_alone(bake, tmp_path, cache_folder, monkeypatch):
    monkeypatch.setattr(bake_verb, "bake_to_folder", lambda *_: {"seconds": 1.0, "files": ["a.exr"]})
    facts, _ = bake(tmp_path, BakeRequest(coherence_length_m="--no-cache"))
    assert facts["cached"] is False
    assert not cache_folder.exists()


# Two processes


def test_two_at_once_make_one_bake(scan, tmp_path, cache_folder):
    both = [Child(scan, tmp_path, tmp_path / name) for name in ("left", "right")]
    facts = [child.facts() for child in both]
    assert sorted(each["cached"] for each in facts) == [False, True]
    maker, taker = sorted(both, key=lambda child: facts[both.index(child)]["cached"])
    assert maker.stages == ["transforms", "wavelengths", "self-check"]
    assert taker.stages == [cache.WAITING]
    assert facts[0]["seconds"] == facts[1]["seconds"]
    files = [Path(each["files"][0]) for each in facts]
    assert files[0].read_bytes() == files[1].read_bytes()
    for file in files:
        assert atlas_file.read(file)[0].terms.any()
        assert_nothing_is_left(cache_folder, file.parent)


def test_two_at_once_into_one_folder(tmp_path, cache_folder):
    """Many rounds of a bake that takes no time: whoever comes second finds the other's."""
    code = STOPPED.replace('"k" * 64', "str(n) * 64").replace("cache.bake_once", "for n in range(9): cache.bake_once")
    output = tmp_path / "out"
    command = [sys.executable, "-c", code, str(output), "nowhere"]
    both = [subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    for process in both:
        assert process.communicate(timeout=60)[1] == "" and process.returncode == 0
    assert (output / "a.exr").read_bytes() == b"whole" * 1000
    assert_nothing_is_left(cache_folder, output, entries=9)


def test_a_killed_bake_does_not_stop_the_next(scan, bake, tmp_path, cache_folder):
    """Nor the one that waits for it: the lock dies with the process."""
    output = tmp_path / "out"
    killed, heir = Child(scan, tmp_path, output), None
    try:
        killed.wait_for("transforms")
        heir = Child(scan, tmp_path, tmp_path / "heir")
        heir.wait_for(cache.WAITING)
        assert killed.process.poll() is None
    finally:
        killed.process.kill()
        killed.process.wait()
    assert names(output) == [] and names(cache_folder / "entries") == []
    assert heir.facts()["cached"] is False
    assert_nothing_is_left(cache_folder, tmp_path / "heir")
    facts, _ = bake(output)
    assert facts["cached"] is True
    assert_nothing_is_left(cache_folder, output)
    fresh, _ = bake(tmp_path / "fresh", BakeRequest(coherence_length_m="--no-cache"))
    (table, record), (expected, expected_record) = (atlas_file.read(Path(f["files"][0])) for f in (facts, fresh))
    # A matrix product's order of summation is free: a half float may round the other way.
    np.testing.assert_allclose(table.terms, expected.terms, rtol=2**-10, atol=1e-6 * np.abs(expected.terms).max())
    assert record.pop("delta_e") == pytest.approx(expected_record.pop("delta_e"), rel=1e-3)
    assert record == expected_record


@pytest.mark.parametrize("point", ["copy", "rename", "delivery"])
@pytest.mark.parametrize("same", [True, False], ids=["same", "other"])
def test_what_a_killed_run_left_goes(tmp_path, cache_folder, point, same):
    """At the worst moments; swept by the next run, of the same surface or another, which is right."""
    output = tmp_path / "out"
    run = subprocess.run([sys.executable, "-c", STOPPED, str(output), point], cwd=ROOT, timeout=60)
    assert run.returncode == 9
    assert not (output / "a.exr").exists() and any((cache_folder / "locks").iterdir())
    if point == "delivery":
        assert len(names(cache_folder / "entries")) == 1
    else:
        assert names(cache_folder / "entries") == [] and len(names(cache_folder / "partial")) == 1
    calls = []
    cache.bake_once("k" * 64 if same else key(1), output, fake(b"whole" * 1000, calls))
    assert len(calls) == (0 if same and point == "delivery" else 1)
    assert (output / "a.exr").read_bytes() == b"whole" * 1000
    assert names(cache_folder / "partial") == []
    if same:
        assert_nothing_is_left(cache_folder, output)


def test_what_another_process_is_at_is_not_swept(tmp_path, cache_folder):
    other = cache.Cache(cache_folder, 0)
    with other.lock(key(1), never):
        unfinished = cache_folder / "partial" / key(1)
        unfinished.mkdir(parents=True)
        cache.bake_once(key(2), tmp_path, fake())
        assert unfinished.is_dir()
    cache.bake_once(key(2), tmp_path, never)
    assert names(cache_folder / "partial") == []


# Damage, and folders that cannot be used


@pytest.mark.parametrize("damage", ["cut", "flipped", "gone", "record cut", "record of another", "record gone"])
def test_a_damaged_entry_is_made_anew(tmp_path, cache_folder, damage):
    cache.bake_once(key(1), tmp_path / "first", fake(b"table" * 100))
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
        facts = cache.bake_once(key(1), tmp_path / "out", fake(b"table" * 100, calls))
        assert (tmp_path / "out" / "a.exr").read_bytes() == b"table" * 100
    assert calls == [None] and facts["cached"] is True
    assert_nothing_is_left(cache_folder, tmp_path / "out")


def test_a_folder_that_cannot_be_costs_one_line(bake, tmp_path, monkeypatch):
    """A file stands in its place."""
    taken = tmp_path / "taken"
    taken.write_text("mine")
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE", str(taken / "cache"))
    facts, err = bake(tmp_path / "out", BakeRequest(delta_e="none", coherence_length_m="--progress"))
    assert facts["cached"] is False
    assert err.startswith("warning: ") and len(err.splitlines()) == 1 and "NATURAL_GRATINGS_CACHE" in err
    assert names(tmp_path / "out") == SKIN


def test_no_home_costs_one_line(tmp_path, monkeypatch, capsys):
    def homeless():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("NATURAL_GRATINGS_CACHE")
    monkeypatch.setattr(Path, "home", homeless)
    assert cache.bake_once(key(1), tmp_path, fake())["cached"] is False
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_a_full_disk_costs_one_line(tmp_path, cache_folder, monkeypatch, capsys):
    def full(source, target):
        raise OSError(errno.ENOSPC, "No space left on device", str(target))

    monkeypatch.setattr(cache.shutil, "copyfile", full)
    facts = cache.bake_once(key(1), tmp_path / "out", fake())
    assert facts == {"seconds": 2.5, "files": [str(tmp_path / "out" / "a.exr")], "cached": False}
    err = capsys.readouterr().err
    assert "No space left" in err and len(err.splitlines()) == 1
    assert names(cache_folder / "entries") == names(cache_folder / "partial") == []
    assert names(tmp_path / "out") == ["a.exr"]


def test_a_bake_that_fails_leaves_nothing(tmp_path, cache_folder):
    def fail(folder):
        fake()(folder)
        raise GratingError("skin: misses its budget; ask for more")

    with pytest.raises(GratingError):
        cache.bake_once(key(1), tmp_path, fail)
    assert names(tmp_path) == names(cache_folder / "entries") == []
    assert cache.bake_once(key(1), tmp_path, fake())["cached"] is False


# The limit


def test_the_longest_unused_goes_first(tmp_path, cache_folder, monkeypatch):
    """Room for three entries of 300,000 bytes; the first is used again before the fourth comes."""
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE_MB", "0.95")
    for number in range(3):
        cache.bake_once(key(number), tmp_path, fake(bytes(300_000)))
        os.utime(cache_folder / "entries" / key(number) / "record.json", (1e9 + number, 1e9 + number))
    cache.bake_once(key(0), tmp_path, never)
    cache.bake_once(key(3), tmp_path, fake(bytes(300_000)))
    assert names(cache_folder / "entries") == [key(0), key(2), key(3)]
    assert_nothing_is_left(cache_folder, tmp_path, entries=3)


def test_the_last_one_stays_whatever_its_size(tmp_path, cache_folder, monkeypatch):
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE_MB", "0")
    for number in range(2):
        cache.bake_once(key(number), tmp_path, fake(bytes(5000)))
    assert names(cache_folder / "entries") == [key(1)]
    assert cache.bake_once(key(1), tmp_path, never)["cached"] is True


def test_an_entry_in_use_is_not_evicted(tmp_path, cache_folder, monkeypatch):
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE_MB", "0")
    cache.bake_once(key(1), tmp_path, fake())
    with cache.Cache(cache_folder, 0).lock(key(1), never):
        cache.bake_once(key(2), tmp_path, fake())
        assert names(cache_folder / "entries") == [key(1), key(2)]


@pytest.mark.parametrize("text", ["much", "-1", "nan", "inf"])
def test_limits_that_are_none(tmp_path, monkeypatch, text):
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE_MB", text)
    with pytest.raises(GratingError, match="NATURAL_GRATINGS_CACHE_MB .*; "):
        cache.bake_once(key(1), tmp_path, never)


def test_folder_and_limit_when_nothing_is_set(monkeypatch):
    monkeypatch.delenv("NATURAL_GRATINGS_CACHE")
    assert cache.default_folder() == Path.home() / ".cache" / "natural-gratings"
    assert cache.size_limit() == 2 << 30
