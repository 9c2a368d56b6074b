# SPDX-License-Identifier: GPL-3.0-or-later
"""The cache of bakes on a folder that several machines share: no locks, dead machines, wrong clocks, other
processors, read-only folders, and the limit of age."""

import errno
import os
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from precompute.bake import cache
from precompute.base import locks, shared_folder
from precompute.base.failure import GratingError
from precompute.base.shared_folder import server_now_ns

from .conftest import ROOT, assert_nothing_is_left, bake_once, fake, key, key_of, names, never
from .test_cache_keys import height_map, request

__all__ = ["height_map"]  # the fixture
posix = pytest.mark.skipif(not hasattr(locks, "fcntl"), reason="Windows locks in another way")


@pytest.fixture
def without_locks(monkeypatch):
    def refused(*_):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(locks.fcntl, "flock", refused)


def record_of(cache_folder, number):
    return cache_folder / "entries" / key(number) / "record.json"


@posix
@pytest.mark.parametrize("same_output", [True, False])
def test_without_locks_the_first_bake_counts(tmp_path, cache_folder, without_locks, capsys, same_output):
    """A second machine, whose sums have other bytes, bakes in the middle of the first one's bake."""
    outputs = tmp_path / "first", tmp_path / ("first" if same_output else "second")

    def slow(folder, progress):
        (folder / "a.exr").write_bytes(b"half")
        bake_once(key(1), outputs[1], fake(b"of the second"))
        return fake(b"of the first")(folder)

    facts = bake_once(key(1), outputs[0], slow)
    assert facts["cached"] is False and facts["files"] == [str(outputs[0] / "a.exr")]
    bake_once(key(1), tmp_path / "third", never)
    for output in (*outputs, tmp_path / "third"):
        assert (output / "a.exr").read_bytes() == b"of the second"
        assert_nothing_is_left(cache_folder, output)
    assert capsys.readouterr().err == ""


@posix
def test_without_locks_damage_and_limits_work(tmp_path, cache_folder, without_locks, monkeypatch):
    bake_once(key(1), tmp_path, fake(b"good"))
    (cache_folder / "entries" / key(1) / "files" / "a.exr").write_bytes(b"evil")
    bake_once(key(1), tmp_path, fake(b"good"))
    assert bake_once(key(1), tmp_path, never)["cached"] is True
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE_MB", "0")
    bake_once(key(2), tmp_path, fake())
    assert names(cache_folder / "entries") == [key(2)]


def test_a_dead_machine_s_lock_does_not_hide_the_entry(tmp_path, cache_folder):
    """The entry is there, so nobody waits for the lock."""
    bake_once(key(1), tmp_path, fake())
    with cache.Cache(cache_folder).hold(key(1)):
        assert bake_once(key(1), tmp_path / "other", never)["cached"] is True


def test_a_process_that_reads_without_the_lock_is_not_swept(tmp_path, cache_folder):
    """While it copies an entry that another process had locked, a third one gets the lock and cleans up the same
    output."""
    bake_once(key(1), tmp_path, fake())
    lock = cache.Cache(cache_folder).hold(key(1))

    def believed(*_):
        with lock:
            pass
        assert bake_once(key(1), tmp_path, never)["cached"] is True
        return True

    assert cache.bake_once(key(1), tmp_path, never, of={}, believed=believed)["cached"] is True
    assert_nothing_is_left(cache_folder, tmp_path)


def test_a_dead_machine_s_lock_does_not_stop_a_bake(tmp_path, cache_folder, monkeypatch):
    monkeypatch.setattr(shared_folder, "SILENT_SECONDS", 0.2)
    with cache.Cache(cache_folder).hold(key(1)):
        assert bake_once(key(1), tmp_path, fake())["cached"] is False
    assert bake_once(key(1), tmp_path, never)["cached"] is True
    assert_nothing_is_left(cache_folder, tmp_path)


def test_a_bake_shows_signs_of_life(tmp_path, cache_folder):
    """Its progress touches the lock's file and the folder with its unfinished files."""
    lock, seen = cache_folder / "locks" / f"{key(1)}.lock", []

    def make(folder, progress):
        for path in (lock, folder):
            os.utime(path, (0, 0))
        progress("baking", 0.0)
        seen.extend(path.stat().st_mtime for path in (lock, folder))
        return fake()(folder)

    bake_once(key(1), tmp_path, make)
    assert len(seen) == 2 and min(seen) > 0


def test_an_entry_that_vanishes_while_it_is_read_is_made_anew(tmp_path, cache_folder, monkeypatch):
    """As when another machine removes it."""
    bake_once(key(1), tmp_path / "first", fake())
    read = cache.Cache.record

    def record(self, wanted):
        found = read(self, wanted)
        self.clear(wanted)
        return found

    monkeypatch.setattr(cache.Cache, "record", record)
    assert bake_once(key(1), tmp_path / "second", fake())["cached"] is False
    assert names(tmp_path / "second") == ["a.exr"]


def test_what_another_machine_is_at_is_not_swept(tmp_path, cache_folder):
    """Its partial folders, in the cache and in the output, are young by the server's clock. An hour later they go."""
    left = cache_folder / "partial" / f"{key(1)}.elsewhr0.1", tmp_path / f".bake.{key(1)[:16]}.elsewhr0.1.partial"
    for path in left:
        path.mkdir(parents=True)
    bake_once(key(1), tmp_path, fake())
    bake_once(key(2), tmp_path, fake())
    assert all(path.is_dir() for path in left)
    hour_ago = server_now_ns(tmp_path) - 3600 * 10**9
    for path in left:
        os.utime(path, ns=(hour_ago, hour_ago))
    bake_once(key(1), tmp_path, never)
    assert not any(path.exists() for path in left)


def test_clocks_hours_apart_do_not_change_what_goes(tmp_path, cache_folder, monkeypatch):
    """This machine's clock is of 1970. The third entry was stored when the server's clock was a year ahead: it counts
    as used at the next eviction, and later as any other."""
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE_MB", "1.2")
    monkeypatch.setattr(time, "time", lambda: 0.0)
    for number in range(3):
        bake_once(key(number), tmp_path, fake(bytes(300_000)))
    now_ns = server_now_ns(tmp_path)
    for number, hours in enumerate((-2, -1, 24 * 365)):
        at_ns = now_ns + hours * 3600 * 10**9
        os.utime(record_of(cache_folder, number), ns=(at_ns, at_ns))
    bake_once(key(0), tmp_path, never)
    bake_once(key(3), tmp_path, fake(bytes(600_000)))
    assert names(cache_folder / "entries") == [key(0), key(2), key(3)]
    assert record_of(cache_folder, 2).stat().st_mtime_ns < now_ns + 3600 * 10**9


def test_what_is_unused_for_days_goes(tmp_path, cache_folder, monkeypatch):
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE_DAYS", "2")
    now_ns = server_now_ns(tmp_path)
    for number, days in enumerate((3, 1)):
        bake_once(key(number), tmp_path, fake())
        at_ns = now_ns - days * cache.NS_OF_A_DAY
        os.utime(record_of(cache_folder, number), ns=(at_ns, at_ns))
    bake_once(key(2), tmp_path, fake())
    assert names(cache_folder / "entries") == [key(1), key(2)]


@pytest.mark.parametrize("text", ["soon", "-1", "nan"])
def test_days_that_are_none(tmp_path, monkeypatch, text):
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE_DAYS", text)
    with pytest.raises(GratingError, match="NATURAL_GRATINGS_CACHE_DAYS .*; give a number of days"):
        bake_once(key(1), tmp_path, never)


@posix
def test_a_cache_that_only_others_may_write_serves(tmp_path, cache_folder, monkeypatch, capsys):
    bake_once(key(1), tmp_path, fake())

    def read_only(path):
        raise OSError(errno.EROFS, "Read-only file system", str(path))

    monkeypatch.setattr(shared_folder, "try_lock", read_only)
    assert bake_once(key(1), tmp_path / "taken", never)["cached"] is True
    assert capsys.readouterr().err == ""
    assert bake_once(key(2), tmp_path / "made", fake())["cached"] is False
    err = capsys.readouterr().err
    assert "Read-only file system" in err and len(err.splitlines()) == 1
    assert names(cache_folder / "entries") == [key(1)]


def test_a_farm_of_mixed_processors_bakes_once(height_map, tmp_path, monkeypatch):  # noqa: F811  the fixture
    """Two machines with other vector instructions have one key, and use the same bytes, if they share bakes."""
    keys = {}
    for shared in ("", "0", "1"):
        monkeypatch.setenv("NATURAL_GRATINGS_CACHE_SHARED", shared)
        for machine in ("AVX2", "AVX512_SKX"):
            simd = {"SIMD Extensions": {"found": [machine]}}
            monkeypatch.setattr(np, "show_config", lambda mode, simd=simd: simd)
            keys[shared, machine] = key_of([height_map], request())
            bake_once(keys[shared, machine], tmp_path / (shared or "unset") / machine, fake(machine.encode()))
    assert keys["", "AVX2"] == keys["0", "AVX2"] != keys["", "AVX512_SKX"] == keys["0", "AVX512_SKX"]
    assert keys["1", "AVX2"] == keys["1", "AVX512_SKX"] not in (keys["", "AVX2"], keys["", "AVX512_SKX"])
    assert (tmp_path / "0" / "AVX512_SKX" / "a.exr").read_bytes() == b"AVX512_SKX"
    assert (tmp_path / "1" / "AVX512_SKX" / "a.exr").read_bytes() == b"AVX2"
    monkeypatch.setattr(np, "__version__", "1.0")
    assert key_of([height_map], request()) != keys["1", "AVX2"], "another NumPy still bakes of its own"


def test_a_farm_ignores_the_last_digits_of_heights(height_map, monkeypatch):  # noqa: F811  the fixture
    """Heights of 100 nm with rounding errors, and with errors of 0.1 nm, ten times the step that counts."""
    noisy = replace(height_map, height_m=height_map.height_m * (1 + 4 * np.finfo(float).eps))
    other = replace(height_map, height_m=height_map.height_m + 1e-10)
    for shared in ("0", "1"):
        monkeypatch.setenv("NATURAL_GRATINGS_CACHE_SHARED", shared)
        keys = [key_of([each], request()) for each in (height_map, noisy, other)]
        assert (keys[0] == keys[1]) == (shared == "1") and keys[2] not in keys[:2]


@pytest.mark.night("test_without_locks_the_first_bake_counts")
def test_a_processor_without_vector_instructions_has_the_key_of_the_farm(monkeypatch):
    """NumPy really runs other code, which computes other last digits of a sample's heights."""
    found = np.show_config(mode="dicts").get("SIMD Extensions", {}).get("found", ())
    if not found:
        pytest.skip("NumPy uses no vector instructions here that can be switched off")
    code = "from precompute.bake import cache; from precompute.bake.request import BakeRequest, Scan; "
    code += "print(cache.key_of(cache.content_of([Scan('sample:elaphe').read()], BakeRequest())))"
    keys = {}
    for shared in ("0", "1"):
        for off in ("", " ".join(found)):
            words = {"NATURAL_GRATINGS_CACHE_SHARED": shared, "NPY_DISABLE_CPU_FEATURES": off}
            told = subprocess.run(
                [sys.executable, "-c", code],
                cwd=ROOT,
                env=os.environ | words,
                capture_output=True,
                text=True,
                check=True,
            )
            keys[shared, bool(off)] = told.stdout
    assert keys["1", False] == keys["1", True]
    assert keys["0", False] != keys["0", True]


def test_sharing_is_yes_or_no(height_map, monkeypatch):  # noqa: F811  the fixture
    monkeypatch.setenv("NATURAL_GRATINGS_CACHE_SHARED", "maybe")
    with pytest.raises(GratingError, match="NATURAL_GRATINGS_CACHE_SHARED maybe: .*; give 1"):
        key_of([height_map], request())
