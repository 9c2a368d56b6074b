# SPDX-License-Identifier: GPL-3.0-or-later
"""Child processes, such as a background Blender, each with a private folder and a deadline.

A keeper (keeper.py) supervises the process. It ends the process and removes its folder if this program is killed. It
enforces the deadline even if the process hangs in code that ignores signals."""

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

# -P: no imports from the working folder, which strangers may write to. -s: no imports from the user's site-packages.
PYTHON_FLAGS = ("-P", "-s")
_KEEPER = Path(__file__).with_name("keeper.py")


class ChildProcess:
    """A running process. Poll `running` or call `wait`; then read the output in `out_path` and `err_path`.

    The output goes to files in a private temporary folder: a pipe could fill up and block the process. This program
    locks a file there. The keeper ends the process when the lock is released."""

    def __init__(
        self,
        prepare: Callable[[Path], Sequence[str]],
        environment: Mapping[str, str],
        *,
        longest_seconds: float = math.inf,
    ) -> None:
        """Start the command that `prepare` returns. `prepare` gets the private folder and writes the input files there.
        After `longest_seconds` the process is ended. Raises GratingError if a file cannot be written."""
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
        """Whether the process still runs."""
        return self._process.poll() is None

    @property
    def status(self) -> int | None:
        """The exit status of an ended process; 128 + N if signal N ended it."""
        return self._process.returncode

    @property
    def is_late(self) -> bool:
        """Whether the process was ended at its deadline."""
        return self.status == LATE

    def wait(self) -> None:
        """Wait until the process ends. An interrupt (Ctrl-C) cancels the process."""
        try:
            self._process.wait()
        except BaseException:
            self.cancel()
            raise

    def cancel(self) -> None:
        """Stop the process and remove its files."""
        self._lock.close()
        try:
            self._process.wait(3 * GRACE_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self.clean_up()

    def clean_up(self) -> None:
        """Remove the private folder. Subclasses remove more."""
        self._lock.close()
        self._private.cleanup()


def inherited_environment() -> dict[str, str]:
    """Return this program's environment without the PYTHON* variables, which Blender ignores too."""
    return {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}


def lines_of(path: Path) -> list[str]:
    """Read a process's output as lines."""
    return path.read_text(encoding="utf-8", errors="replace").splitlines()
