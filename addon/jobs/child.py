# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs in a separate process: Blender's interface stays responsive, and ending the process cancels a job. A second
Blender, too, leaves the artist's file and windows alone."""

import contextlib
import importlib.util
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import bpy

from ...precompute.bake.cache import FOLDER_VARIABLE
from ...precompute.base.child_process import PYTHON_FLAGS, ChildProcess, inherited_environment, lines_of
from ...precompute.base.failure import GratingError
from ...precompute.base.progress import Progress, silent
from ...precompute.base.strict import failure_in, read_json
from ..gratings.cache_folder import cache_folder

ROOT = Path(__file__).resolve().parents[2]
# The time between two looks at a process's reports. A batch's log needs no shorter one.
_POLL_SECONDS = 0.2


@dataclass(frozen=True)
class Deadline:
    """The time limit for a job that hangs, for example while reading a scan from a drive that does not answer.

    seconds  limit, longer than any valid job takes
    failure  error for the user: the file or mesh, what was not done, and the remedy"""

    seconds: float
    failure: GratingError


class ReportingProcess(ChildProcess):
    """A process that reports progress on standard error, as lines of JSON."""

    def progress(self) -> tuple[str, float]:
        """The last reported stage, and its completed fraction."""
        return next(reversed(self._reports()), ("starting", 0.0))

    def wait(self, progress: Progress = silent) -> None:
        """Wait until the process ends, and pass all its reports to `progress`. An interrupt (Ctrl-C) cancels the
        process."""
        passed = 0
        try:
            running = True
            while running:
                with contextlib.suppress(subprocess.TimeoutExpired):
                    self._process.wait(_POLL_SECONDS)
                running = self.running
                reports = self._reports()
                for report in reports[passed:]:
                    progress(*report)
                passed = len(reports)
        except BaseException:
            self.cancel()
            raise

    def _reports(self) -> list[tuple[str, float]]:
        """All reports so far: stages, and their completed fractions."""
        lines = [line for line in lines_of(self.err_path) if line.startswith('{"stage"') and line.endswith("}")]
        return [(report["stage"], report["fraction"]) for report in map(json.loads, lines)]


class Job(ReportingProcess):
    """A process `python -m precompute VERB ... -o FOLDER` that reports progress as JSON.

    Without a folder, it writes into its private folder, which is removed with the job."""

    def __init__(
        self,
        verb: str,
        arguments: Sequence[str] | Callable[[Path], Sequence[str]],
        folder: Path | None = None,
        *,
        deadline: Deadline,
    ) -> None:
        """Start the process. `arguments` may write files into the private folder. Raises GratingError if this fails."""

        self._verb, self._deadline = verb, deadline

        def prepare(private: Path) -> list[str]:
            self._written = folder or private / "written"
            words = arguments(private) if callable(arguments) else arguments
            command = [sys.executable, *PYTHON_FLAGS, "-m", "precompute", verb, *words]
            return [*command, "-o", str(self._written), "--json", "-", "--progress", "json"]

        super().__init__(prepare, child_environment(), longest_seconds=deadline.seconds)

    def result(self, take: Callable[[dict[str, Any]], Any] = lambda facts: facts) -> Any:
        """What `take` returns for the facts that the finished process reported; by default the facts. `take` may read
        files in the private folder, which is then removed. Raises GratingError if the process failed or was late."""
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
        fault = last or f"its process ended without a message (status {self.status})"
        raise failure_in(told) or GratingError(self._verb, fault, "try again")

    def clean_up(self) -> None:
        """Remove the private folder, and partial files that a killed process left behind."""
        for left in self._written.glob(f".*.{self.folder.name}.partial"):
            shutil.rmtree(left, ignore_errors=True)
        super().clean_up()


def child_environment() -> dict[str, str]:
    """The environment of the process: it finds precompute in this extension, the packages of this Blender, and the
    cache. A missing or broken package gives a one-line error in the process that needs it."""
    path = os.pathsep.join(dict.fromkeys([str(ROOT), *package_folders()]))
    ours = {"PYTHONPATH": path, "PYTHONIOENCODING": "utf-8", FOLDER_VARIABLE: str(cache_folder())}
    return inherited_environment() | ours


def package_folders() -> list[str]:
    """The folders from which this Blender imports the packages that precompute needs."""
    folders = []
    for package in ("numpy", "OpenEXR", "PIL", "xatlas"):
        spec = importlib.util.find_spec(package)
        if spec is None or spec.origin is None:
            continue
        origin = Path(spec.origin)
        folders.append(str(origin.parents[1] if origin.name == "__init__.py" else origin.parent))
    return list(dict.fromkeys(folders))


def background_blender(script: Path, *arguments: str) -> list[str]:
    """The command that runs a script in a Blender with factory settings and without a window. Code in a file that the
    script opens does not run."""
    if bpy.app.binary_path:
        background = ("--background", "--factory-startup", "--disable-autoexec", "--python-exit-code", "1")
        return [bpy.app.binary_path, *background, "--python", str(script), "--", *arguments]
    return [sys.executable, *PYTHON_FLAGS, str(script), *arguments]
