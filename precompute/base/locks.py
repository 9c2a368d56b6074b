# SPDX-License-Identifier: GPL-3.0-or-later
"""File locks of the operating system, which releases them when their process ends."""

import errno
import os
import sys
from pathlib import Path
from typing import BinaryIO

if sys.platform == "win32":
    import msvcrt
else:
    import fcntl

# What a folder reports that has no locks, for example NFS without its lock daemon or Lustre without the option `flock`.
_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOTSUP, errno.EINVAL}
_OPENED = os.O_RDWR | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)


def try_lock(path: Path) -> BinaryIO | None:
    """Lock a file without waiting, and return it; close it to release the lock. Returns None if another process has it.

    A missing file is created. Raises OSError if that fails, or if the path is a symbolic link."""
    lock = os.fdopen(os.open(path, _OPENED, 0o666), "a+b")
    try:
        if _locked(lock, path):
            return lock
    except BaseException:
        lock.close()
        raise
    lock.close()
    return None


def has_no_locks(error: OSError) -> bool:
    """Whether an error of try_lock means that no process can lock files there."""
    return error.errno in _NO_LOCKS


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
        # If the last holder removed the file after it was opened here, the next process would lock a new file, and
        # both would believe that they hold the lock.
        return os.path.samestat(os.fstat(lock.fileno()), path.stat())
    except (BlockingIOError, FileNotFoundError):
        return False
