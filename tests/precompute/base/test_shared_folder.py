# SPDX-License-Identifier: GPL-3.0-or-later
"""Folders that several machines share: waits that end, signs of life, the server's clock, and leftovers."""

import errno
import os
import time

import pytest

from precompute.base import locks, shared_folder
from precompute.base.locks import has_no_locks, try_lock
from precompute.base.progress import silent
from precompute.base.shared_folder import beating, hold_later, hold_now, is_left_behind, machine_name, server_now_ns

HOUR_NS = 3600 * 10**9


def nothing():
    """A wait that is not counted."""


@pytest.fixture
def impatient(monkeypatch):
    """A process is taken for dead after 0.3 seconds: three polls and more, so that a wait sees signs of life."""
    monkeypatch.setattr(shared_folder, "SILENT_SECONDS", 0.3)
    monkeypatch.setattr(shared_folder, "_LAST_POLL_SECONDS", 0.1)


def test_a_lock_is_taken_once_and_then_given_up(tmp_path):
    with hold_now(tmp_path / "locks" / "a.lock") as hold:
        assert hold.is_locked and hold.fault is None
        assert hold_now(hold.path) is None
    with hold_now(hold.path) as again:
        assert again.is_locked


@pytest.mark.skipif(not hasattr(locks, "fcntl"), reason="Windows locks in another way")
@pytest.mark.parametrize("number", [errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS])
def test_a_server_without_locks_stops_nobody(tmp_path, monkeypatch, number):
    def refused(*_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(locks.fcntl, "flock", refused)
    for _ in range(2):
        with hold_now(tmp_path / "a.lock") as hold:
            assert not hold.is_locked and hold.fault is None


def test_a_folder_that_cannot_be_is_told(tmp_path):
    (tmp_path / "taken").write_text("mine")
    with hold_now(tmp_path / "taken" / "a.lock") as hold:
        assert not hold.is_locked and isinstance(hold.fault, OSError) and not has_no_locks(hold.fault)


def test_the_lock_of_a_dead_machine_is_not_waited_for_for_ever(tmp_path, impatient):
    """This process keeps the lock open without a sign, as a server does that never releases a dead machine's lock."""
    waits = []
    path = tmp_path / "a.lock"
    with try_lock(path), hold_later(path, lambda: waits.append(1)) as hold:
        assert not hold.is_locked and hold.fault is None
    assert len(waits) >= 2


def test_a_living_machine_is_waited_for(tmp_path, impatient):
    """The holder touches the file at each of the first twelve polls, which take at least 1.2 s, four times the silence
    that counts as death. Then it releases the lock. The times that it sets are of 1970: only a change counts."""
    path, waits = tmp_path / "a.lock", []
    lock = try_lock(path)

    def touch():
        waits.append(1)
        os.utime(path, (len(waits), len(waits)))
        if len(waits) == 12:
            lock.close()

    with hold_later(path, touch) as hold:
        assert hold.is_locked
    assert len(waits) == 12


def test_progress_is_a_sign_of_life(tmp_path, monkeypatch):
    path, told = tmp_path / "a.lock", []
    path.touch()
    monkeypatch.setattr(shared_folder, "_BEAT_SECONDS", 0.0)
    progress = beating(lambda *step: told.append(step), path, tmp_path / "gone")
    for step in range(3):
        os.utime(path, (0, 0))
        progress("baking", step / 2)
        assert path.stat().st_mtime > 0
    assert told == [("baking", 0.0), ("baking", 0.5), ("baking", 1.0)]


def test_signs_of_life_do_not_burden_the_server(tmp_path):
    path = tmp_path / "a.lock"
    path.touch()
    progress = beating(silent, path)
    progress("baking", 0.0)
    os.utime(path, (0, 0))
    progress("baking", 0.1)
    assert path.stat().st_mtime == 0


def test_the_server_s_clock_is_asked_not_this_machine_s(tmp_path, monkeypatch):
    """The kernel gives files its own time, so a lying time.time stands for a machine whose clock is wrong."""
    truth = time.time_ns()
    monkeypatch.setattr(time, "time", lambda: 0.0)
    monkeypatch.setattr(time, "time_ns", lambda: 0)
    # A kernel's time of a file lags by a tick, at most 10 ms.
    assert 0 <= server_now_ns(tmp_path) - truth + 10**7 < 60 * 10**9
    assert list(tmp_path.iterdir()) == []


def test_whose_leftovers_go_at_once(tmp_path):
    own, other = (tmp_path / f"key.{machine}.abc" for machine in (machine_name(), "elsewhr0"))
    now = server_now_ns(tmp_path)
    for path in (own, other):
        (path / "files").mkdir(parents=True)
    with hold_now(tmp_path / "a.lock") as hold:
        assert is_left_behind(own, hold, now)
        assert not is_left_behind(other, hold, now)
        assert is_left_behind(other, hold, now + HOUR_NS)
        (other / "files" / "a.exr").touch()
        os.utime(other / "files" / "a.exr", ns=(now + HOUR_NS, now + HOUR_NS))
        assert not is_left_behind(other, hold, now + HOUR_NS), "a file in it has just changed"
    unlocked = shared_folder.Hold(tmp_path / "a.lock", None)
    assert not is_left_behind(own, unlocked, now) and is_left_behind(own, unlocked, now + HOUR_NS)


def test_a_machine_has_one_short_name():
    assert machine_name() == machine_name() and len(machine_name()) == 8 and machine_name().isalnum()
