# SPDX-License-Identifier: GPL-3.0-or-later
"""Precompute's work in a process of its own. Blender's interface stays alive, and work is cancelled by ending the
process."""

import importlib.util
import json
import os
import shutil
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...precompute.bake.cache import FOLDER_VARIABLE
from ...precompute.base.child_process import PYTHON_FLAGS, ChildProcess, inherited_environment, lines_of
from ...precompute.base.failure import GratingError
from ...precompute.base.failure_line import failure_in
from ...precompute.base.strict_json import read_json
from ..gratings.grating import cache_folder

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Deadline:
    """Ends a job that hangs, such as one that reads a scan from a drive that does not answer.

    seconds  after which the job is ended; longer than any honest job takes
    failure  what the user then reads: the file or mesh, what was not done, and the remedy"""

    seconds: float
    failure: GratingError


class Job(ChildProcess):
    """`python -m precompute VERB ... -o FOLDER` with JSON progress.

    Without a folder it writes into the private one, which is removed with the job."""

    def __init__(
        self,
        verb: str,
        arguments: Sequence[str] | Callable[[Path], Sequence[str]],
        folder: Path | None = None,
        *,
        deadline: Deadline,
    ) -> None:
        """Start it. Arguments may be made by a function, which is given the private folder to write files there for
        the verb to read. Raises GratingError where no file can be written."""

        self._verb, self._deadline = verb, deadline

        def prepare(private: Path) -> list[str]:
            self._written = folder or private / "written"
            words = arguments(private) if callable(arguments) else arguments
            command = [sys.executable, *PYTHON_FLAGS, "-m", "precompute", verb, *words]
            return [*command, "-o", str(self._written), "--json", "-", "--progress", "json"]

        super().__init__(prepare, child_environment(), longest_seconds=deadline.seconds)

    def progress(self) -> tuple[str, float]:
        """The stage and the fraction of it that is done, as last reported."""
        for line in reversed(lines_of(self.err_path)):
            if line.startswith('{"stage"') and line.endswith("}"):
                report = json.loads(line)
                return report["stage"], report["fraction"]
        return "starting", 0.0

    def result(self, take: Callable[[dict[str, Any]], Any] = lambda facts: facts) -> Any:
        """What `take` makes of the facts of the run, once it has ended; by default the facts. It may read files in the
        private folder, which is removed after it. Raises the process's own GratingError if it failed, or the
        deadline's if it was late."""
        told = lines_of(self.err_path)
        try:
            if self.status == 0:
                return take(read_json(self.out_path, "try again"))
        finally:
            self.clean_up()
        if self.is_late:
            raise self._deadline.failure
        # Python and libraries print lines of their own.
        last = next((line for line in reversed(told) if line.strip() and not line.startswith("{")), "")
        fault = last or f"its process ended without a word (status {self.status})"
        raise failure_in(told) or GratingError(self._verb, fault, "try again")

    def clean_up(self) -> None:
        """Remove the private folder, and what the process has left in the job's name where it was killed."""
        for left in self._written.glob(f".*.{self.folder.name}.partial"):
            shutil.rmtree(left, ignore_errors=True)
        super().clean_up()


def child_environment() -> dict[str, str]:
    """The process's environment: it finds precompute in this extension, the packages where this Blender has them, and
    the extension's cache. What needs a package that is missing or broken fails there with one line."""
    folders = [str(ROOT)]
    for package in ("numpy", "OpenEXR", "PIL", "xatlas"):
        spec = importlib.util.find_spec(package)
        if spec is None or spec.origin is None:
            continue
        origin = Path(spec.origin)
        folders.append(str(origin.parents[1] if origin.name == "__init__.py" else origin.parent))
    path = os.pathsep.join(dict.fromkeys(folders))
    ours = {"PYTHONPATH": path, "PYTHONIOENCODING": "utf-8", FOLDER_VARIABLE: str(cache_folder())}
    return inherited_environment() | ours
