# SPDX-License-Identifier: GPL-3.0-or-later
"""Running slow commands with progress on standard error. Standard output is for a verb's own output."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from pathlib import Path
from typing import Any, NoReturn

from . import ROOT, DevError

HEARTBEAT_SECONDS = 15
# Seconds that a command has to end after a signal.
GRACE_SECONDS = 10
running: set[subprocess.Popen] = set()


def say(text: str) -> None:
    """Print a line to standard error."""
    print(f"[dev] {text}", file=sys.stderr, flush=True)


def clean_environment(**changes: str) -> dict[str, str]:
    """This process's environment with `changes`, and without variables that would mislead another Python. That Python
    never imports from the working folder, which may hold an unrelated json.py. It keeps byte code: without, each of a
    test run's hundreds of processes compiles this project anew (0.4 s)."""
    astray = {"PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "__PYVENV_LAUNCHER__", "PYTHONDONTWRITEBYTECODE"}
    kept = {name: value for name, value in os.environ.items() if name not in astray}
    return kept | {"PYTHONSAFEPATH": "1"} | changes


def project_environment(**changes: str) -> dict[str, str]:
    """clean_environment for a Python that imports this project's packages."""
    return clean_environment(PYTHONPATH=str(ROOT), **changes)


def become(command: Sequence[str | Path], environment: Mapping[str, str]) -> NoReturn:
    """Replace this process by a command: the command gets its signals, and sets its exit status."""
    sys.stdout.flush()
    for each in (signal.SIGPIPE, signal.SIGXFSZ):  # Python ignores these signals, and the command would inherit that
        signal.signal(each, signal.SIG_DFL)
    os.execve(command[0], [str(part) for part in command], environment)


def last_lines(log: Path, count: int) -> list[str]:
    lines = log.read_text(errors="replace").splitlines()
    return [line.strip() for line in lines if line.strip()][-count:]


def run_step(title: str, command: Sequence[str | Path], log: Path, **changes: str) -> None:
    """Run a command with its output in `log`. Print its title, and every 15 seconds a sign of progress. `changes` are
    environment variables. Raises DevError with the log's last lines if the command fails. An interrupt ends it too."""
    log.parent.mkdir(parents=True, exist_ok=True)
    start = time.monotonic()
    say(f"{title} ...")
    with (
        log.open("wb") as output,
        subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            env=clean_environment(**changes),
        ) as process,
    ):
        running.add(process)
        try:
            while process.poll() is None:
                try:
                    process.wait(HEARTBEAT_SECONDS)
                except subprocess.TimeoutExpired:
                    seconds = time.monotonic() - start
                    say(f"{title}: {seconds:.0f} s: {' '.join(last_lines(log, 1))[:90]}")
        finally:
            process.terminate()
            running.remove(process)
    if process.returncode != 0:
        reason = " | ".join(last_lines(log, 3))
        raise DevError(f"{title} failed with exit status {process.returncode}: {reason} (all of it: {log})")
    say(f"{title}: done in {time.monotonic() - start:.0f} s")


def run_together(tasks: Sequence[Callable[[], Any]], workers: int = 4) -> list[Any]:
    """Run tasks in parallel and return their results. Raises the error of the first task that failed. An interrupt ends
    the running commands and starts no more."""
    with ThreadPoolExecutor(workers) as pool:
        jobs = [pool.submit(task) for task in tasks]
        try:
            wait(jobs)
        except BaseException:
            for job in jobs:
                job.cancel()
            _end_running(jobs)
            raise
    return [job.result() for job in jobs]


def _end_running(jobs: Sequence[Future]) -> None:
    """End the commands of jobs: first by SIGINT as Ctrl-C does, so that a test can clean up, then by force."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
        for process in list(running):
            process.send_signal(number)
        if not wait(jobs, GRACE_SECONDS).not_done:
            return
