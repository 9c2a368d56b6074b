# SPDX-License-Identifier: GPL-3.0-or-later
"""A run that works for another program notices the end of that program by a lock."""

import subprocess
import sys
from pathlib import Path

import pytest

from precompute.base.job import JOB_VARIABLE, LOCK, is_forsaken, job_name, remove_if_forsaken
from precompute.base.locks import try_lock

ROOT = Path(__file__).resolve().parents[3]
# Locks a given file and waits to be killed.
HOLDER = """
import sys, time
from pathlib import Path
from precompute.base.locks import try_lock
lock = try_lock(Path(sys.argv[1]))
print("locked", flush=True)
time.sleep(60)
"""


def test_a_run_of_nobody_is_not_forsaken(monkeypatch):
    monkeypatch.delenv(JOB_VARIABLE, raising=False)
    assert job_name() == "" and not is_forsaken()


def test_a_job_is_forsaken_when_its_starter_is_killed(tmp_path, monkeypatch):
    folder = tmp_path / "natural-gratings-1"
    folder.mkdir()
    monkeypatch.setenv(JOB_VARIABLE, str(folder))
    command = [sys.executable, "-c", HOLDER, str(folder / LOCK)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE) as starter:
        assert starter.stdout.readline() == b"locked\n"
        assert job_name() == folder.name and not is_forsaken()
        remove_if_forsaken()
        assert folder.exists()
        starter.kill()
    assert is_forsaken()
    remove_if_forsaken()
    assert not folder.exists() and is_forsaken()


def test_a_lock_is_one_s_own_until_it_is_closed(tmp_path):
    lock = try_lock(tmp_path / "lock")
    assert try_lock(tmp_path / "lock") is None
    lock.close()
    try_lock(tmp_path / "lock").close()


def test_a_link_in_the_place_of_a_lock_is_not_followed(tmp_path):
    (tmp_path / "lock").symlink_to(tmp_path / "victim")
    with pytest.raises(OSError, match="lock"):
        try_lock(tmp_path / "lock")
    assert not (tmp_path / "victim").exists()
