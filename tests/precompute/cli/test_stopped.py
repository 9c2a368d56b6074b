# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs stopped by a signal, from the terminal or from the starting program: one line, and no leftovers."""

import signal
import subprocess
import sys
import time

import pytest

from devtools import ROOT
from devtools.steps import project_environment
from precompute.base.job import JOB_VARIABLE, LOCK
from precompute.base.locks import try_lock

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows ends a process without asking it")

STOPPING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP) if sys.platform != "win32" else ()
PROGRAM = (sys.executable, "-m", "precompute")
# ./dev replaces itself by the program, so that signals reach it.
DEV = (sys.executable, str(ROOT / "dev"), "grating")


@pytest.fixture(autouse=True)
def signals_of_a_terminal():
    """Restore the default signals: a test run in the background or under nohup inherits ignored signals."""
    ignored = [number for number in STOPPING if signal.getsignal(number) == signal.SIG_IGN]
    for number in ignored:
        signal.signal(number, signal.default_int_handler)
    yield
    for number in ignored:
        signal.signal(number, signal.SIG_IGN)


@pytest.fixture
def start(tmp_path, cache_folder):
    """A function that starts a long bake and returns once it is at work."""
    started = []

    def bake(command=PROGRAM, *options, **variables):
        line = [*command, "bake", "sample:elaphe", "-o", tmp_path / "out", "--json", tmp_path / "facts.json", *options]
        told = (tmp_path / "told").open("w+")
        process = subprocess.Popen(
            [str(each) for each in line], env=project_environment(**variables), stdout=told, stderr=told
        )
        started.append((process, told))
        deadline = time.monotonic() + 60
        while "transforms" not in (tmp_path / "told").read_text():
            assert process.poll() is None and time.monotonic() < deadline
            time.sleep(0.02)
        return process

    yield bake
    for process, told in started:
        process.kill()
        process.wait()
        told.close()


def left_in(folder):
    """All files and folders except the log `told`."""
    return [path for path in folder.rglob("*") if path.name != "told"]


@pytest.mark.short("SIGINT-program", "SIGTERM-dev", "SIGHUP-program")
@pytest.mark.parametrize("command", [PROGRAM, DEV], ids=["program", "dev"])
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_ends_a_run(start, tmp_path, cache_folder, command, name):
    number = getattr(signal, name)
    process = start(command)
    process.send_signal(number)
    assert process.wait(60) == 128 + number
    errors = [line for line in (tmp_path / "told").read_text().splitlines() if "%" not in line]
    assert errors == [f"error: stopped by {name}; nothing was written"]
    assert left_in(tmp_path) == [] and left_in(cache_folder / "entries") == left_in(cache_folder / "partial") == []


def test_a_second_signal_does_not_stop_the_cleaning(start, tmp_path):
    process = start(PROGRAM, "--no-cache")
    for _ in range(50):
        process.send_signal(signal.SIGTERM)
        process.send_signal(signal.SIGINT)
    assert process.wait(60) in (128 + signal.SIGTERM, 128 + signal.SIGINT)
    assert (tmp_path / "told").read_text().count("error: ") == 1
    assert left_in(tmp_path) == []


@pytest.mark.night("test_a_signal_ends_a_run")
def test_a_run_under_nohup_goes_on(start):
    process = start(("nohup", *PROGRAM), "--no-cache")
    process.send_signal(signal.SIGHUP)
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(2)


def test_a_run_ends_with_the_program_that_it_works_for(start, tmp_path):
    folder = tmp_path / "natural-gratings-1"
    folder.mkdir()
    lock = try_lock(folder / LOCK)
    process = start(PROGRAM, **{JOB_VARIABLE: str(folder)})
    assert process.poll() is None
    lock.close()
    assert process.wait(60) != 0
    assert left_in(tmp_path) == []


@pytest.mark.night("test_a_signal_ends_a_run")
def test_a_run_that_waits_for_another_ends_too(start, tmp_path, cache_folder):
    """The waiting run has no progress to report."""
    start()
    folder = tmp_path / "natural-gratings-1"
    folder.mkdir()
    lock = try_lock(folder / LOCK)
    line = [*PROGRAM, "bake", "sample:elaphe", "-o", str(tmp_path / "two")]
    environment = project_environment(**{JOB_VARIABLE: str(folder)})
    with subprocess.Popen(line, env=environment, stderr=subprocess.PIPE) as second:
        assert b"waiting for another" in second.stderr.readline()
        lock.close()
        assert second.wait(60) != 0
    assert not (tmp_path / "two").exists() and not folder.exists()


@pytest.mark.night("test_a_signal_ends_a_run")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_to_the_demo_ends_its_step(tmp_path, name):
    line = [sys.executable, str(ROOT / "dev"), "demo", "--output", str(tmp_path / "demo")]
    with subprocess.Popen(line, env=project_environment(), stdout=subprocess.PIPE, text=True) as demo:
        while "bake ..." not in demo.stdout.readline():
            assert demo.poll() is None
        time.sleep(2)
        demo.send_signal(getattr(signal, name))
        assert demo.wait(60) == 128 + getattr(signal, name)
    assert [path for path in tmp_path.rglob("*") if path.is_file() or path.suffix == ".partial"] == []
