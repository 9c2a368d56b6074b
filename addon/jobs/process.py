# SPDX-License-Identifier: GPL-3.0-or-later
"""A process beside Blender: its private folder, its end, and what it leaves."""

import os
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from ...precompute.base.files import told_of
from ...precompute.base.job import JOB_VARIABLE, LOCK
from ...precompute.base.locks import try_lock

# Time in seconds for a process to remove what it has written; after that, it is killed.
_GRACE_SECONDS = 5


class ChildProcess:
    """A running process. Poll `running`, or `wait`; then it has ended, and `out_path` and `err_path` are what it said.

    It writes to files in a private temporary folder and not to pipes, which could fill up and block it. Blender holds a
    lock there: where Blender ends without a word, the process notices it and ends too (precompute/base/job.py)."""

    def __init__(self, prepare: Callable[[Path], Sequence[str]], environment: Mapping[str, str]) -> None:
        """Start the command that `prepare` returns. It is given the private folder, to write there what the process is
        to read. Raises GratingError where no file can be written."""
        with told_of(Path(tempfile.gettempdir())):
            self._private = tempfile.TemporaryDirectory(prefix="natural-gratings-", ignore_cleanup_errors=True)
            self.folder = Path(self._private.name)
            self._lock = try_lock(self.folder / LOCK)
            self.out_path, self.err_path = self.folder / "out.txt", self.folder / "err.txt"
            command = prepare(self.folder)
            with self.out_path.open("wb") as out, self.err_path.open("wb") as err:
                self._process = subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=out, stderr=err,
                    env={**environment, JOB_VARIABLE: str(self.folder)},
                )  # fmt: skip

    @property
    def running(self) -> bool:
        """Whether the process has not ended yet."""
        return self._process.poll() is None

    @property
    def status(self) -> int | None:
        """Its exit status, once it has ended; negative where a signal ended it."""
        return self._process.returncode

    def wait(self, longest_seconds: float | None = None) -> None:
        """Return when the process has ended. Where the wait is interrupted, or takes longer, the process is stopped;
        the latter raises subprocess.TimeoutExpired."""
        try:
            self._process.wait(longest_seconds)
        except BaseException:
            self.cancel()
            raise

    def cancel(self) -> None:
        """Stop the process and remove what it has written so far."""
        self._process.terminate()
        try:
            self._process.wait(_GRACE_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self.clean_up()

    def clean_up(self) -> None:
        """Remove what it left: the private folder. Others add to it."""
        self._lock.close()
        self._private.cleanup()


def inherited_environment() -> dict[str, str]:
    """Blender's environment. What the user's says to other Pythons is left out, as Blender itself does."""
    return {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}


def lines_of(path: Path) -> list[str]:
    """What a process said."""
    return path.read_text(encoding="utf-8", errors="replace").splitlines()
