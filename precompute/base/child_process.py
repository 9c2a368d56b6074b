# SPDX-License-Identifier: GPL-3.0-or-later
"""A process beside this one, which may be Blender: its private folder, its deadline, its end, and what it leaves.

It runs under a keeper (keeper.py). The keeper ends it and removes its folder if this program is killed, and ends it at
its deadline even if it hangs in code that hears no signal."""

import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from .files import told_of
from .job import JOB_VARIABLE, LOCK
from .keeper import GRACE_SECONDS, LATE
from .locks import try_lock

# No import from the working folder, which may be anyone's, nor from the user's own site-packages; no bytecode beside
# the extension's sources.
PYTHON_FLAGS = ("-P", "-s", "-B")
_KEEPER = Path(__file__).with_name("keeper.py")


class ChildProcess:
    """A running process. Poll `running`, or `wait`; then it has ended, and `out_path` and `err_path` are what it said.

    It writes to files in a private temporary folder and not to pipes, which could fill up and block it. This program
    holds a lock there. The keeper sees by this lock whether this program still lives and still wants the process."""

    def __init__(
        self,
        prepare: Callable[[Path], Sequence[str]],
        environment: Mapping[str, str],
        *,
        longest_seconds: float = math.inf,
    ) -> None:
        """Start the command that `prepare` returns. It is given the private folder, to write there what the process is
        to read. After `longest_seconds` the process is ended. Raises GratingError where no file can be written."""
        with told_of(Path(tempfile.gettempdir())):
            self._private = tempfile.TemporaryDirectory(prefix="natural-gratings-", ignore_cleanup_errors=True)
            self.folder = Path(self._private.name)
            lock = try_lock(self.folder / LOCK)
            assert lock is not None  # no other process knows the folder yet
            self._lock = lock
            self.out_path, self.err_path = self.folder / "out.txt", self.folder / "err.txt"
            keeper = [sys.executable, *PYTHON_FLAGS, str(_KEEPER), str(longest_seconds)]
            command = prepare(self.folder)
            with self.out_path.open("wb") as out, self.err_path.open("wb") as err:
                self._process = subprocess.Popen(
                    [*keeper, *command], stdin=subprocess.DEVNULL, stdout=out, stderr=err,
                    env={**environment, JOB_VARIABLE: str(self.folder)},
                )  # fmt: skip

    @property
    def running(self) -> bool:
        """Whether the process has not ended yet."""
        return self._process.poll() is None

    @property
    def status(self) -> int | None:
        """Its exit status, once it has ended; 128 more than the number of the signal that ended it."""
        return self._process.returncode

    @property
    def is_late(self) -> bool:
        """Whether the process was ended at its deadline."""
        return self.status == LATE

    def wait(self) -> None:
        """Return when the process has ended. Where the wait is interrupted, the process is stopped."""
        try:
            self._process.wait()
        except BaseException:
            self.cancel()
            raise

    def cancel(self) -> None:
        """Stop the process and remove what it has written so far."""
        self._lock.close()
        try:
            self._process.wait(3 * GRACE_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self.clean_up()

    def clean_up(self) -> None:
        """Remove what it left: the private folder. Others add to it."""
        self._lock.close()
        self._private.cleanup()


def inherited_environment() -> dict[str, str]:
    """This program's environment. What the user's says to other Pythons is left out, as Blender itself does."""
    return {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}


def lines_of(path: Path) -> list[str]:
    """What a process said."""
    return path.read_text(encoding="utf-8", errors="replace").splitlines()
