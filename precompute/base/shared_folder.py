# SPDX-License-Identifier: GPL-3.0-or-later
"""Work of several machines in one folder, such as a cache on a file server.

Three things differ from a local folder, and none of them may stop a process or spoil a file:

Locks   A file server may have no locks, keep them from other machines, or never release the lock of a machine that
        died. So a lock only saves work, and files must be right without it: they are written under a name of their
        own and renamed when they are complete. A process that works under a lock touches the lock's file every few
        seconds. Another process waits while the file's time changes. If it stays the same for SILENT_SECONDS of the
        waiting process's own clock, the process goes on without the lock.
Clocks  Machines' clocks may differ by hours. Times of files are compared only with the time that the file server gives
        to a new file.
Names   Only the machine that made a partial file can know at once that its process is gone (is_left_behind).
"""

import contextlib
import functools
import hashlib
import os
import platform
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

from .locks import has_no_locks, try_lock
from .progress import Progress

# A process that has given no sign for this time is taken for dead. A bake gives one with each step of its progress,
# which is at most a hundredth of it.
SILENT_SECONDS = 600.0
# Seconds between two signs of life, and between two tries to get a lock: a local wait is too short to notice, and many
# machines do not burden the server.
_BEAT_SECONDS = 10.0
_FIRST_POLL_SECONDS, _LAST_POLL_SECONDS = 0.1, 1.0
# Different on each machine and after each start of it.
_BOOT = Path("/proc/sys/kernel/random/boot_id")


class Hold:
    """The right to work on something until the end of a `with` block.

    path       the lock's file
    is_locked  whether the file is locked for this process. If not, other processes may work on the same thing
    fault      the error, if the file cannot even be opened; else None"""

    def __init__(self, path: Path, lock: BinaryIO | None, fault: OSError | None = None) -> None:
        self.path, self.fault, self._lock = path, fault, lock

    @property
    def is_locked(self) -> bool:
        return self._lock is not None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        if self._lock is not None:
            self._lock.close()


def hold_now(path: Path) -> Hold | None:
    """Lock a file without waiting. Returns None if another process has the lock, and a Hold without a lock if the file
    cannot be locked by anyone, or not by this user."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        lock = try_lock(path)
    except OSError as error:
        return Hold(path, None, None if has_no_locks(error) else error)
    return None if lock is None else Hold(path, lock)


def hold_later(path: Path, waiting: Callable[[], None]) -> Hold:
    """Lock a file; wait while another process has the lock and gives signs of life. `waiting` is called repeatedly."""
    last_sign, since, pause = _changed_ns(path), time.monotonic(), _FIRST_POLL_SECONDS
    while (hold := hold_now(path)) is None:
        waiting()
        if (sign := _changed_ns(path)) != last_sign:
            last_sign, since = sign, time.monotonic()
        elif time.monotonic() - since > SILENT_SECONDS:
            return Hold(path, None)
        time.sleep(pause)
        pause = min(1.2 * pause, _LAST_POLL_SECONDS)
    return hold


def beating(progress: Progress, *paths: Path) -> Progress:
    """Return a Progress that also touches the paths, as signs of life."""
    last = -SILENT_SECONDS

    def told(stage: str, fraction: float) -> None:
        nonlocal last
        if time.monotonic() - last > _BEAT_SECONDS:
            last = time.monotonic()
            for path in paths:
                with contextlib.suppress(OSError):
                    os.utime(path, follow_symlinks=os.utime not in os.supports_follow_symlinks)
        progress(stage, fraction)

    return told


def server_now_ns(folder: Path) -> int:
    """The time of the file server in nanoseconds. Raises OSError if the folder cannot be written into."""
    with tempfile.TemporaryFile(dir=folder) as file:
        return os.fstat(file.fileno()).st_mtime_ns


@functools.cache
def machine_name() -> str:
    """A short name of this machine, for the names of its partial files."""
    own = _BOOT.read_text() if _BOOT.is_file() else platform.node()
    return hashlib.sha256(own.encode()).hexdigest()[:8]


def is_left_behind(partial: Path, hold: Hold, now_ns: int) -> bool:
    """Whether the process that made a partial folder is gone, so that the folder may be removed.

    The folder's name has the part machine_name(). This process has the Hold of the partial folder's subject; `now_ns`
    is the server's time. Another machine's folder is left behind if nothing in it has changed for SILENT_SECONDS."""
    if partial.is_symlink() or (hold.is_locked and machine_name() in partial.name.split(".")):
        return True
    changes = [_changed_ns(path) or now_ns for path in (partial, *partial.rglob("*"))]
    return now_ns - max(changes) > SILENT_SECONDS * 1e9


def _changed_ns(path: Path) -> int | None:
    try:
        return path.lstat().st_mtime_ns
    except OSError:
        return None
