# SPDX-License-Identifier: GPL-3.0-or-later
"""A child process: it ends at its deadline, when it is cancelled, and with the program that started it, even if it
ignores signals. It leaves nothing behind."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from precompute.base.child_process import ChildProcess, lines_of

ROOT = Path(__file__).resolve().parents[3]
# Prints its process number, ignores the signals that can be caught, and hangs.
DEAF = """
import os, signal, time
for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    signal.signal(number, signal.SIG_IGN)
print(os.getpid(), flush=True)
time.sleep(60)
"""
STARTER = f"""
import sys, time
from precompute.base.child_process import ChildProcess, lines_of
child = ChildProcess(lambda folder: [sys.executable, "-c", {DEAF!r}], {{}})
while not lines_of(child.out_path):
    time.sleep(0.02)
print(lines_of(child.out_path)[0], flush=True)
time.sleep(60)
"""


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    """The parent of private folders."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def python(code, **rest):
    return ChildProcess(lambda folder: [sys.executable, "-c", code], dict(os.environ), **rest)


def is_alive(process):
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def wait_for(condition):
    deadline = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_what_it_says_and_its_status_are_kept(temporary):
    child = python("import sys; print('out'); print('err', file=sys.stderr); sys.exit(3)")
    child.wait()
    assert (child.running, child.status, child.is_late) == (False, 3, False)
    assert (lines_of(child.out_path), lines_of(child.err_path)) == (["out"], ["err"])
    child.clean_up()
    assert not list(temporary.iterdir())


def test_a_signal_that_ended_it_is_its_status():
    child = python("import os, signal; os.kill(os.getpid(), signal.SIGKILL)")
    child.wait()
    assert child.status == 128 + 9
    child.clean_up()


def test_a_command_that_is_not_there_is_one_line():
    child = ChildProcess(lambda folder: ["/nowhere/blender"], {})
    child.wait()
    assert child.status == 127
    assert lines_of(child.err_path) == [
        "error: /nowhere/blender: cannot be started (No such file or directory); check that it is there"
    ]
    child.clean_up()


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks Linux for the process")
def test_one_that_hears_nothing_is_ended_at_its_deadline(temporary):
    child = python(DEAF, longest_seconds=1)
    child.wait()
    # On a busy machine a Python may not have begun after a second.
    assert child.is_late and not any(map(is_alive, lines_of(child.out_path)))
    child.clean_up()
    assert not list(temporary.iterdir())


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks Linux for the process")
def test_one_that_is_cancelled_leaves_nothing(temporary):
    child = python("import os, time; print(os.getpid(), flush=True); time.sleep(60)")
    wait_for(lambda: lines_of(child.out_path))
    process = lines_of(child.out_path)[0]
    child.cancel()
    assert not child.running and not child.is_late and not is_alive(process)
    assert not list(temporary.iterdir())


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks Linux for the process")
def test_one_that_hears_nothing_ends_with_the_program_that_is_killed(tmp_path):
    environment = os.environ | {"TMPDIR": str(tmp_path), "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", STARTER]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as starter:
        process = starter.stdout.readline().strip()
        assert is_alive(process) and list(tmp_path.iterdir())
        starter.send_signal(signal.SIGKILL)
    wait_for(lambda: not is_alive(process) and not list(tmp_path.iterdir()))
