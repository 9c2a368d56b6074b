# SPDX-License-Identifier: GPL-3.0-or-later
"""Precompute's work in a process of its own. Blender's interface stays alive, and work is cancelled by ending the
process."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...precompute.bake.cache import FOLDER_VARIABLE
from ...precompute.base.failure import GratingError
from ...precompute.base.files import told_of
from ...precompute.base.job import JOB_VARIABLE, LOCK
from ...precompute.base.locks import try_lock
from ...precompute.base.strict_json import read_json
from ..scene.gratings import cache_folder

ROOT = Path(__file__).resolve().parents[2]
# No import from the working folder, which may be anyone's, nor from the user's own site-packages; no bytecode beside
# the extension's sources.
_PYTHON_FLAGS = ("-P", "-s", "-B")
# Time in seconds for a process to remove what it has written; after that, it is killed.
_GRACE_SECONDS = 5


class Job:
    """`python -m precompute VERB ... -o FOLDER` with JSON progress.

    The process writes to files in a private temporary folder and not to pipes, which could fill up and block it. A
    request for `bake` is handed to it as a file in the same folder. Blender holds a lock there: where Blender ends
    without a word, the process notices it and ends too (precompute/base/job.py)."""

    def __init__(
        self, verb: str, arguments: Sequence[str], folder: Path, *, request: Mapping[str, Any] | None = None
    ) -> None:
        self._folder = folder
        environment = child_environment()
        with told_of(Path(tempfile.gettempdir())):
            self._private = tempfile.TemporaryDirectory(prefix="natural-gratings-", ignore_cleanup_errors=True)
            private = Path(self._private.name)
            self._lock = try_lock(private / LOCK)
            self._out_path, self._err_path = private / "result.json", private / "progress.jsonl"
            command = [sys.executable, *_PYTHON_FLAGS, "-m", "precompute", verb, *arguments]
            command += ["-o", str(folder), "--json", "-", "--progress", "json"]
            if request is not None:
                path = private / "request.json"
                path.write_text(json.dumps(request), encoding="utf-8")
                command += ["--request", str(path)]
            with self._out_path.open("wb") as out, self._err_path.open("wb") as err:
                self._process = subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=out, stderr=err,
                    env=environment | {JOB_VARIABLE: str(private)},
                )  # fmt: skip

    @property
    def running(self) -> bool:
        """Whether the process has not ended yet."""
        return self._process.poll() is None

    def wait(self) -> None:
        """Return when the process has ended. Where the wait is interrupted, the process is stopped."""
        try:
            self._process.wait()
        except BaseException:
            self.cancel()
            raise

    def progress(self) -> tuple[str, float]:
        """The stage and the fraction of it that is done, as last reported."""
        for line in reversed(self._told()):
            if line.startswith("{") and line.endswith("}"):
                report = json.loads(line)
                return report["stage"], report["fraction"]
        return "starting", 0.0

    def result(self) -> dict[str, Any]:
        """The facts of the run, once it has ended. Raises GratingError with the process's own line if it failed."""
        status, told = self._process.returncode, self._told()
        try:
            if status == 0:
                return read_json(self._out_path, "try again")
        finally:
            self._clean_up()
        lines = [line for line in told if line.strip() and not line.startswith("{")]
        message = next((line for line in lines if line.startswith("error: ")), lines[-1] if lines else None)
        if message is None:
            message = f"{self._folder}: its process ended without a word (status {status}); try again"
        raise GratingError(message.removeprefix("error: "))

    def cancel(self) -> None:
        """Stop the process and remove what it has written so far."""
        self._process.terminate()
        try:
            self._process.wait(_GRACE_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._clean_up()

    def _told(self) -> list[str]:
        return self._err_path.read_text(encoding="utf-8", errors="replace").splitlines()

    def _clean_up(self) -> None:
        """Remove the private folder, and what the process has left in the job's name where it was killed."""
        for left in self._folder.glob(f".*.{Path(self._private.name).name}.partial"):
            shutil.rmtree(left, ignore_errors=True)
        self._lock.close()
        self._private.cleanup()


def child_environment() -> dict[str, str]:
    """The process's environment: it finds precompute in this extension, the packages where this Blender has them, and
    the extension's cache. What the user's environment says to other Pythons is left out, as Blender itself does.

    Raises GratingError if a package is missing."""
    packages = ("numpy", "OpenEXR", "PIL", "gwyfile")
    folders = [str(ROOT)]
    for package in packages:
        spec = importlib.util.find_spec(package)
        if spec is None or spec.origin is None:
            raise GratingError(f"{package}: missing from this Blender; reinstall the extension for this platform")
        origin = Path(spec.origin)
        folders.append(str(origin.parents[1] if origin.name == "__init__.py" else origin.parent))
    path = os.pathsep.join(dict.fromkeys(folders))
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    ours = {"PYTHONPATH": path, "PYTHONIOENCODING": "utf-8", FOLDER_VARIABLE: str(cache_folder())}
    return inherited | ours
