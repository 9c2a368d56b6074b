# SPDX-License-Identifier: GPL-3.0-or-later
"""`python keeper.py SECONDS COMMAND...`: runs a command for the program that started this one (child_process.py).

It ends the command after so many seconds, when it is told to end itself, or when the other program has ended or wants
the command no longer; in the last case it removes the job's folder. The command need not help. A Blender that loads a
picture from a dead network drive, or xatlas, runs no Python by which it could notice.
"""

import importlib
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

# The exit status of a command that was ended at its deadline.
LATE = 124
# Seconds for a command to remove what it has written; after that, it is killed.
GRACE_SECONDS = 5
_POLL_SECONDS = 0.1


def keep(command: Sequence[str], longest_seconds: float) -> int:
    """Run a command to its end, which may be early; its exit status, 128 more than the number of a signal."""
    # This file is run by its path, so that a Blender needs no search path for it.
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
    """End a process gently, then by force. One that waits for a dead disk cannot even be killed: it is left."""
    process.terminate()
    if not _wait(process, GRACE_SECONDS):
        process.kill()
        _wait(process, GRACE_SECONDS)


def _wait(process: subprocess.Popen[bytes], seconds: float) -> bool:
    """Whether a process ends within some seconds."""
    try:
        process.wait(seconds)
    except subprocess.TimeoutExpired:
        return False
    return True


if __name__ == "__main__":
    sys.exit(keep(sys.argv[2:], float(sys.argv[1])))
