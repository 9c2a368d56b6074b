# SPDX-License-Identifier: GPL-3.0-or-later
"""The cache under several processes: two at once, and killed ones with what they leave."""

import subprocess
import sys
from pathlib import Path

import pytest

from precompute.bake import cache
from precompute.base.shared_folder import machine_name
from precompute.table import atlas
from tests.precompute.bake.same_bake import assert_same_bake

from .conftest import ROOT, STOPPED, Child, assert_nothing_is_left, bake_once, fake, key, names, never


def test_two_at_once_make_one_bake(picture, tmp_path, cache_folder):
    both = [Child(picture, tmp_path, tmp_path / name) for name in ("left", "right")]
    facts = [child.facts() for child in both]
    assert sorted(each["cached"] for each in facts) == [False, True]
    maker, taker = sorted(both, key=lambda child: facts[both.index(child)]["cached"])
    assert maker.stages[1] == "levelling" and maker.stages[2].startswith("expects ")
    assert maker.stages[3:] == ["transforms", "wavelengths", "self-check"]
    assert taker.stages[1:] == [cache.WAITING]
    assert maker.stages[0] == taker.stages[0] == "reading the scan"
    assert facts[0]["seconds"] == facts[1]["seconds"]
    files = [Path(each["files"][0]) for each in facts]
    assert files[0].read_bytes() == files[1].read_bytes()
    for file in files:
        assert atlas.read(file)[0].terms.any()
        assert_nothing_is_left(cache_folder, file.parent)


@pytest.mark.night("test_two_at_once_make_one_bake")
def test_a_killed_bake_does_not_stop_the_next(picture, run_bake, tmp_path, cache_folder):
    output = tmp_path / "out"
    killed, heir = Child(picture, tmp_path, output), None
    try:
        killed.wait_for("transforms")
        heir = Child(picture, tmp_path, tmp_path / "heir")
        heir.wait_for(cache.WAITING)
        assert killed.process.poll() is None
    finally:
        killed.process.kill()
        killed.process.wait()
    (left,) = output.iterdir()
    assert left.suffix == ".partial" and names(left) == names(cache_folder / "entries") == []
    assert heir.facts()["cached"] is False
    assert_nothing_is_left(cache_folder, tmp_path / "heir")
    facts, _ = run_bake(output)
    assert facts["cached"] is True
    assert_nothing_is_left(cache_folder, output)
    fresh, _ = run_bake(tmp_path / "fresh", "--no-cache")
    assert_same_bake(*(Path(each["files"][0]) for each in (facts, fresh)))


@pytest.mark.parametrize("point", ["copy", "rename", "delivery"])
@pytest.mark.parametrize("same", [True, False], ids=["same", "other"])
def test_what_a_killed_run_left_goes(tmp_path, cache_folder, point, same):
    """After a kill at the worst moments the next bake, of the same or another surface, cleans up and succeeds."""
    output = tmp_path / "out"
    run = subprocess.run([sys.executable, "-c", STOPPED, str(output), point], cwd=ROOT, timeout=60)
    assert run.returncode == 9
    assert not (output / "a.exr").exists() and any((cache_folder / "locks").iterdir())
    if point == "delivery":
        assert len(names(cache_folder / "entries")) == 1
    else:
        assert names(cache_folder / "entries") == [] and len(names(cache_folder / "partial")) == 1
    calls = []
    bake_once("f" * 64 if same else key(1), output, fake(b"whole" * 1000, calls))
    assert len(calls) == (0 if same and point == "delivery" else 1)
    assert (output / "a.exr").read_bytes() == b"whole" * 1000
    assert names(cache_folder / "partial") == []
    if same:
        assert_nothing_is_left(cache_folder, output)


def test_what_another_process_is_at_is_not_swept(tmp_path, cache_folder):
    with cache.Cache(cache_folder).hold(key(1)):
        unfinished = cache_folder / "partial" / f"{key(1)}.{machine_name()}.1"
        unfinished.mkdir(parents=True)
        bake_once(key(2), tmp_path, fake())
        assert unfinished.is_dir()
    bake_once(key(2), tmp_path, never)
    assert names(cache_folder / "partial") == []
