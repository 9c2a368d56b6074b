# SPDX-License-Identifier: GPL-3.0-or-later
"""`python keeper.py SECONDS COMMAND...`: runs and supervises a command for the program that started it.

It ends the command after SECONDS, on a signal to itself, or when the starter (child_process.py) ends or releases its
lock. In the last case it also removes the job's folder. The command needs no code for this: Blender runs no Python
while it loads a picture from a dead network drive, nor while xatlas works."""

import importlib
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

# The exit status after the deadline.
LATE = 124
# The time for a command to remove its files before it is killed.
GRACE_SECONDS = 5
_POLL_SECONDS = 0.1


def keep(command: Sequence[str], longest_seconds: float) -> int:
    """Run and supervise a command; return its exit status, or 128 + N if signal N ended it."""
    # This file is run by its path, so the package must be put on the search path.
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))
    job = importlib.import_module("precompute.base.job")
    told_to_end: list[int] = []
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):  # Windows has no SIGHUP
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, lambda number, _: told_to_end.append(number))
    try:
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL)
    except OSError as error:
        print(f"error: {command[0]}: cannot be started ({error.strerror}); check that it is there", file=sys.stderr)
        return 127
    deadline = time.monotonic() + longest_seconds
    status = None
    while status is None and process.poll() is None:
        if told_to_end or job.is_forsaken():
            status = 128 + (told_to_end or [signal.SIGTERM])[0]
        elif time.monotonic() > deadline:
            status = LATE
        else:
            _wait(process, _POLL_SECONDS)
    if status is not None:
        _end(process)
    job.remove_if_forsaken()
    if status is None:
        status = process.returncode if process.returncode >= 0 else 128 - process.returncode
    return status


def _end(process: subprocess.Popen[bytes]) -> None:
    """Terminate a process, then kill it. A process that waits for a dead disk survives both and is abandoned."""
    process.terminate()
    if not _wait(process, GRACE_SECONDS):
        process.kill()
        _wait(process, GRACE_SECONDS)


def _wait(process: subprocess.Popen[bytes], seconds: float) -> bool:
    """Whether a process ends within `seconds`."""
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        return False
    return True


if __name__ == "__main__":
    sys.exit(keep(sys.argv[2:], float(sys.argv[1])))
