# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared by tests of the bake: the bake of two crossed waves (once a session), helpers for the cache."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from precompute.bake import cache
from precompute.bake.ensemble import bake
from precompute.bake.request import BakeRequest
from precompute.base.progress import silent
from precompute.cli import parser
from precompute.surface.height_map import HeightMap
from precompute.surface.relief import prepare

# Gives a kernel with a standard deviation of 0.031, which takes about one texel for a dE00 of 1.
COHERENCE_M = 8e-6
ROOT = Path(__file__).resolve().parents[3]
OPTIONS = ("--size-um", "2", "--height-nm", "60", "--coherence-um", "2", "--delta-e", "5")
# The files that a bake of skin.png writes.
SKIN = ["skin.exr", "skin.lobes.exr"]
# A program that calls `bake_once` with an instant bake. Its second argument names a point where one function ends the
# process without clean-up, as a kill does.
STOPPED = """
import os, shutil, sys
from pathlib import Path
from precompute.bake import cache

def make(folder, progress):
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
cache.bake_once("f" * 64, Path(sys.argv[1]), make, of={}, believed=lambda *_: True)
"""


def waves(depth=150e-9):
    """Two crossed waves of a surface that wraps: 5 um along T, and 2.5 um along B at half the amplitude. All their
    orders lie within |u| = 1.6."""
    x, y = np.meshgrid(*[(np.arange(64) + 0.5) / 64] * 2)
    heights = depth / 2 * (np.sin(2 * np.pi * x) + 0.5 * np.sin(2 * np.pi * 2 * y + 1))
    return prepare(HeightMap(heights, (5e-6 / 64, 5e-6 / 64), "test", periodic=True))


@pytest.fixture(scope="session")
def made():
    """The bake of `waves`, and the (stage, fraction) pairs that it reported."""
    told = []
    return bake(
        waves(),
        BakeRequest(coherence_length_m=COHERENCE_M),
        progress=lambda stage, fraction: told.append((stage, fraction)),
    ), told


@pytest.fixture(scope="session")
def baked(made):
    return made[0]


@pytest.fixture(scope="session")
def picture(tmp_path_factory):
    """A grey picture of an irregular grating, 24 x 24 pixels."""
    path = tmp_path_factory.mktemp("scan") / "skin.png"
    x, y = np.meshgrid(*[np.arange(24) / 24] * 2)
    grey = 127 + 90 * np.sin(2 * np.pi * 3 * x + np.sin(2 * np.pi * y)) + 30 * np.cos(4 * np.pi * y)
    Image.fromarray(grey.astype(np.uint8)).save(path)
    return path


@pytest.fixture
def run_bake(picture, capsys):
    """A function that runs the verb `bake` in this process and returns its facts and its standard error."""

    def run(output, *options, file=picture):
        capsys.readouterr()
        arguments = ["bake", file, *OPTIONS, "-o", output, "--progress", "json", "--json", "-", *options]
        assert parser.main([str(each) for each in arguments]) == 0
        out, err = capsys.readouterr()
        return json.loads(out), err

    return run


class Child:
    """A bake of the picture in its own process, with its output in files."""

    def __init__(self, picture: Path, folder: Path, output: Path):
        self.out, self.err = (folder / f"{output.name}.{kind}" for kind in ("out", "err"))
        command = [sys.executable, "-m", "precompute", "bake", picture, *OPTIONS, "-o", output, "--progress", "json"]
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
    """An instant bake. It appends to `calls` the names that it finds in its folder."""

    def make(folder, progress=silent):
        if calls is not None:
            calls.append(names(folder))
        (folder / "a.exr").write_bytes(content)
        return {"seconds": 2.5, "files": [str(folder / "a.exr")]}

    return make


def bake_once(key, output, make):
    return cache.bake_once(key, output, make, of={}, believed=lambda facts, _: facts["files"] == ["a.exr"])


def key_of(height_maps, request):
    return cache.key_of(cache.content_of(height_maps, request))


def never(*_, **__):
    """A stand-in for a bake that must not run."""
    raise AssertionError("baked again")


def key(number):
    return f"{number:064x}"


def names(folder):
    """The sorted names in a folder; empty if there is no folder."""
    return sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []


def assert_nothing_is_left(cache_folder, output, entries=1):
    """Check that the output has whole files, and the cache whole entries and nothing else."""
    assert names(output) in (["a.exr"], SKIN)
    assert names(cache_folder / "partial") == []
    assert len(names(cache_folder / "entries")) == entries
    for entry in (cache_folder / "entries").iterdir():
        assert names(entry) == ["files", "record.json"]
    if os.name == "posix":
        assert len(names(cache_folder / "locks")) == entries
