# SPDX-License-Identifier: GPL-3.0-or-later
"""A lock on a file, through the operating system. The system releases it when the process that holds it ends."""

import os
import sys
from pathlib import Path
from typing import BinaryIO

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

_OPENED = os.O_RDWR | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)


def try_lock(path: Path) -> BinaryIO | None:
    """Lock a file, without waiting. Closing the file that is returned releases the lock; None if another has it.

    The file is made if it is not there. Raises OSError if it cannot be, or if a symbolic link is in its place."""
    lock = os.fdopen(os.open(path, _OPENED, 0o666), "a+b")
    try:
        if _locked(lock, path):
            return lock
    except BaseException:
        lock.close()
        raise
    lock.close()
    return None


def _locked(lock: BinaryIO, path: Path) -> bool:
    if sys.platform == "win32":
        try:
            lock.seek(0)
            msvcrt.locking(lock.fileno(), msvcrt.LK_NBLCK, 1)
        except PermissionError:
            return False
        return True
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        # The last holder may have removed the file after we opened it. The next process would then lock a new file,
        # and both would think that they hold the lock.
        return os.path.samestat(os.fstat(lock.fileno()), path.stat())
    except (BlockingIOError, FileNotFoundError):
        return False
