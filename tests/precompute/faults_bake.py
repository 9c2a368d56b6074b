# SPDX-License-Identifier: GPL-3.0-or-later
"""Faults of disks, paths, clocks, processes and memory, each injected for real into a bake outside Blender."""

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from precompute.base.strict import failure_in
from precompute.table import atlas

from .faulty_disks import assert_no_leftovers, contents, read_only, small_disk, take_away

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]  # a module has no type that includes None

ROOT = Path(__file__).resolve().parents[2]
# A coarse bake of one wavelength: it takes about a second, start included.
_COARSE = ("--size-um", "4", "--height-nm", "100", "--coherence-um", "3", "--delta-e", "9", "--illuminant", "532nm")
# An earlier bake in the output, which no failing bake may change.
_EARLIER = {"skin.exr": b"earlier", "skin.lobes.exr": b"earlier"}
# Disks with room for the earlier files and no bake: a bake's files have 300 KiB and more.
_FULL_KIB = 64
_PATIENCE = 60.0
# A process whose address space may grow to this many MiB: below what Python and NumPy need for a bake, to above it.
MEMORIES_MIB = (250, 300, 400, 500, 600, 800, 1000)


def cases(kills: int, memories_mib: Sequence[int] = MEMORIES_MIB) -> dict[str, Callable[[Path], str]]:
    """The faults by name, each with a function that injects it in an empty folder and returns the line that the user
    sees, or what happened instead. `kills` bakes are killed; the limits of memory increase."""
    return {
        "the output's disk is full": _full_output,
        "the cache's disk is full": _full_cache,
        "the output is read-only": _read_only_output,
        "the cache is read-only and has the bake": partial(_read_only_cache, has_it=True),
        "the cache is read-only and lacks the bake": partial(_read_only_cache, has_it=False),
        "the output folder is deleted during a bake": partial(_deleted, what="out"),
        "the cache is deleted during a bake": partial(_deleted, what="cache"),
        "the output's disk is pulled out during a bake": _pulled_out,
        "a scan whose name has 255 bytes, most not ASCII": _long_name,
        "a folder whose name has 300 bytes": partial(_long_path, parts=["d" * 300]),
        "a path of 5,000 bytes": partial(_long_path, parts=["d" * 200] * 25),
        "the cache's path is too long": _long_cache,
        "two bakes at once, one output, one cache": _two_at_once,
        "the cache's times are of 1970": partial(_wrong_times, seconds=0),
        "the cache's times are of 2100": partial(_wrong_times, seconds=4102444800),
        f"a bake is killed at {kills} random moments": partial(_killed, kills=kills),
        f"memory is limited to {memories_mib[0]} to {memories_mib[-1]} MiB": partial(
            _little_memory, memories_mib=memories_mib
        ),
    }


class Bake:
    """A bake of a small scan in a process of its own."""

    def __init__(
        self, folder: Path, output: Path | str, *, cache: str = "cache", scan: str = "skin.png", most_bytes: int = 0
    ) -> None:
        """Start it in a folder, in which it finds the scan, makes its cache, and prints into a file. `most_bytes`
        limits its address space."""
        limits = resource and partial(resource.setrlimit, resource.RLIMIT_AS, (most_bytes, most_bytes))
        self.folder, self._told = folder, folder / f"told{time.monotonic_ns()}.txt"
        words = [scan, *_COARSE, "-o", str(output), "--progress", "json", "--json", os.devnull]
        with self._told.open("wb") as told:
            self.process = subprocess.Popen(
                [sys.executable, "-P", "-m", "precompute", "bake", *words], cwd=folder, stderr=told,
                stdout=subprocess.DEVNULL, preexec_fn=limits if most_bytes else None,
                env={**os.environ, "PYTHONPATH": str(ROOT), "NATURAL_GRATINGS_CACHE": str(folder / cache)},
            )  # fmt: skip

    def lines(self) -> list[str]:
        """What it has printed, without its progress."""
        lines = self._told.read_text(encoding="utf-8", errors="replace").splitlines()
        return [line for line in lines if not line.startswith('{"stage"')]

    def wait_for(self, stage: str) -> None:
        """Wait until it reports a stage."""
        deadline = time.monotonic() + _PATIENCE
        while f'"{stage}"' not in self._told.read_text(encoding="utf-8", errors="replace"):
            assert self.process.poll() is None and time.monotonic() < deadline, f"no stage {stage}"
            time.sleep(0.01)

    def end(self, status: int) -> str:
        """Wait for its end. Returns the line that it printed, if any. Raises AssertionError for another status, or if
        it printed more."""
        ended, lines = self.process.wait(_PATIENCE), self.lines()
        assert not any("Traceback" in line for line in lines), "a traceback"
        assert ended == status, f"status {ended}: {lines}"
        assert len(lines) <= 1, f"{len(lines)} lines"
        failure = failure_in(lines)
        return f"error: {failure}" if failure else "".join(lines)


def scan_in(folder: Path, name: str = "skin.png") -> None:
    """Write the small scan."""
    x = np.arange(64) / 64
    Image.fromarray(np.tile((127 + 90 * np.sin(2 * np.pi * 5 * x)).astype(np.uint8), (64, 1))).save(folder / name)


def _prepared(folder: Path) -> Path:
    """Write the scan, and an earlier bake into the output. Returns the output."""
    scan_in(folder)
    output = folder / "out"
    output.mkdir()
    _write_earlier(output)
    return output


def _write_earlier(output: Path) -> None:
    for name, data in _EARLIER.items():
        (output / name).write_bytes(data)


def _assert_earlier(output: Path) -> None:
    assert contents(output) == _EARLIER, f"the earlier bake is changed, or files are left: {sorted(contents(output))}"
    assert_no_leftovers(output)


def _assert_whole(output: Path, cache: Path) -> None:
    """The output has a whole bake, and nothing unfinished is left."""
    files = list(output.glob("*.exr"))
    assert len(files) == 2, f"{len(files)} files"
    atlas.read(next(file for file in files if not file.stem.endswith(".lobes")))
    assert_no_leftovers(output, cache)


def _verified(folder: Path) -> None:
    """Every bake in the cache matches its record."""
    command = [sys.executable, "-P", "-m", "precompute", "cache", "verify", "--progress", "none"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NATURAL_GRATINGS_CACHE": str(folder / "cache")}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def _full_output(folder: Path) -> str:
    scan_in(folder)
    (folder / "out").mkdir()
    with small_disk(folder / "out", _FULL_KIB):
        _write_earlier(folder / "out")
        line = Bake(folder, "out").end(1)
        _assert_earlier(folder / "out")
    return line


def _full_cache(folder: Path) -> str:
    output = _prepared(folder)
    (folder / "cache").mkdir()
    with small_disk(folder / "cache", _FULL_KIB):
        line = Bake(folder, output).end(0)
        _assert_whole(output, folder / "cache")
        _verified(folder)
    return line


def _read_only_output(folder: Path) -> str:
    output = _prepared(folder)
    with read_only(output):
        line = Bake(folder, output).end(1)
        _assert_earlier(output)
    return line


def _read_only_cache(folder: Path, *, has_it: bool) -> str:
    output = _prepared(folder)
    Bake(folder, "first").end(0)
    if not has_it:
        shutil.copy(folder / "skin.png", folder / "other.png")
    before = contents(folder / "cache")
    with read_only(folder / "cache"):
        line = Bake(folder, "second", scan="skin.png" if has_it else "other.png").end(0)
        assert contents(folder / "cache") == before, "the cache is changed"
    _assert_whole(folder / "second", folder / "cache")
    _assert_earlier(output)
    return line or "the bake, from the cache"


def _deleted(folder: Path, *, what: str) -> str:
    output = _prepared(folder)
    bake = Bake(folder, output)
    bake.wait_for("transforms")
    shutil.rmtree(folder / what)
    line = bake.end(0)
    _assert_whole(output, folder / "cache")
    _verified(folder)
    return line or "the bake, in a new folder"


def _pulled_out(folder: Path) -> str:
    """The disk had the earlier bake; without it, its place is an empty folder."""
    scan_in(folder)
    (folder / "out").mkdir()
    with small_disk(folder / "out", 1 << 16):
        bake = Bake(folder, "out")
        bake.wait_for("transforms")
        take_away(folder / "out")
        line = bake.end(0)
        _assert_whole(folder / "out", folder / "cache")
    return line or "the bake, in the empty folder that is left"


def _long_name(folder: Path) -> str:
    """The bake's file has a longer ending than the scan."""
    name = "\u00e4" * 100 + "\U0001f308" * 12 + "xyz" + ".png"
    assert len(name.encode()) == 255
    scan_in(folder, name)
    line = Bake(folder, "out", scan=name).end(0)
    _assert_whole(folder / "out", folder / "cache")
    return line or "the bake, under a name that is shortened"


def _long_path(folder: Path, *, parts: Sequence[str]) -> str:
    scan_in(folder)
    before = contents(folder)
    line = Bake(folder, "/".join(parts)).end(1)
    assert {name for name in contents(folder) if not name.startswith("told")} == set(before), "files are left"
    return line.replace("/".join(parts), "ddd...")


def _long_cache(folder: Path) -> str:
    scan_in(folder)
    line = Bake(folder, "out", cache="c" * 300).end(0)
    _assert_whole(folder / "out", folder / "cache")
    return line.replace("c" * 300, "ccc...")


def _two_at_once(folder: Path) -> str:
    output = _prepared(folder)
    both = [Bake(folder, output) for _ in range(2)]
    lines = {bake.end(0) for bake in both}
    _assert_whole(output, folder / "cache")
    _verified(folder)
    assert lines == {""}, lines
    return "both end well; one bake is made"


def _wrong_times(folder: Path, *, seconds: int) -> str:
    scan_in(folder)
    Bake(folder, "first").end(0)
    for path in (folder / "skin.png", *(folder / "cache").rglob("*")):
        os.utime(path, (seconds, seconds))
    line = Bake(folder, "second").end(0)
    assert contents(folder / "second") == contents(folder / "first"), "another bake"
    shutil.copy(folder / "skin.png", folder / "other.png")
    line = line or Bake(folder, "third", scan="other.png").end(0)
    assert len(list((folder / "cache" / "entries").iterdir())) == 2, "an entry is lost"
    return line or "the bake, from the cache"


def _killed(folder: Path, *, kills: int) -> str:
    """Kill bakes between their start and their end, in the same output and cache. Whole files appear, or none."""
    if not hasattr(signal, "SIGKILL"):
        pytest.skip("this system has no SIGKILL")
    scan_in(folder)
    began = time.monotonic()
    Bake(folder, "whole").end(0)
    longest = time.monotonic() - began
    shutil.rmtree(folder / "cache")
    whole, chance, reached = contents(folder / "whole"), random.Random(1), 0
    for _ in range(kills):
        bake = Bake(folder, "out")
        time.sleep(chance.uniform(0, longest))
        bake.process.kill()
        bake.process.wait()
        got = {name: data for name, data in contents(folder / "out").items() if "/" not in name}
        assert all(whole[name] == data for name, data in got.items()), "a file is half written"
        reached += bool(got)
        shutil.rmtree(folder / "cache" / "entries", ignore_errors=True)  # else the next takes it at once
    line = Bake(folder, "out").end(0)
    _assert_whole(folder / "out", folder / "cache")
    _verified(folder)
    return line or "the next bake ends well"


def _little_memory(folder: Path, *, memories_mib: Sequence[int]) -> str:
    """Every limit ends in a whole bake or in one line."""
    if resource is None:
        pytest.skip("this system has no limit of the address space")
    output = _prepared(folder)
    seen = []
    for mib in memories_mib:
        before, bake = contents(output), Bake(folder, output, most_bytes=mib << 20)
        status = bake.process.wait(_PATIENCE)
        seen += [bake.end(1)] if status else []
        assert status == 0 or contents(output) == before, "the earlier bake is changed"
    assert seen, "no limit was too low"
    _assert_whole(output, folder / "cache")
    return seen[-1]
