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
from ..scene.gratings import cache_folder

ROOT = Path(__file__).resolve().parents[2]


class Job:
    """`python -m precompute VERB ... -o FOLDER` with JSON progress.

    The process writes to files in a private temporary folder and not to pipes, which could fill up and block it. A
    request for `bake` is handed to it as a file in the same folder."""

    def __init__(
        self, verb: str, arguments: Sequence[str], folder: Path, *, request: Mapping[str, Any] | None = None
    ) -> None:
        self._folder = folder
        self._private = tempfile.TemporaryDirectory(prefix="natural-gratings-")
        private = Path(self._private.name)
        self._out_path, self._err_path = private / "result.json", private / "progress.jsonl"
        command = [sys.executable, "-B", "-m", "precompute", verb, *arguments]
        command += ["-o", str(folder), "--json", "-", "--progress", "json"]
        if request is not None:
            path = private / "request.json"
            path.write_text(json.dumps(request), encoding="utf-8")
            command += ["--request", str(path)]
        with self._out_path.open("wb") as out, self._err_path.open("wb") as err:
            self._process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=out, stderr=err, env=child_environment()
            )

    @property
    def running(self) -> bool:
        """Whether the process has not ended yet."""
        return self._process.poll() is None

    def wait(self) -> None:
        """Return when the process has ended."""
        self._process.wait()

    def progress(self) -> tuple[str, float]:
        """The stage and the fraction of it that is done, as last reported."""
        for line in reversed(self._err_path.read_text(errors="replace").splitlines()):
            if line.startswith("{") and line.endswith("}"):
                report = json.loads(line)
                return report["stage"], report["fraction"]
        return "starting", 0.0

    def result(self) -> dict[str, Any]:
        """The facts of the run, once it has ended. Raises GratingError with the process's own line if it failed."""
        out, err = self._out_path.read_text(errors="replace"), self._err_path.read_text(errors="replace")
        status = self._process.returncode
        self._private.cleanup()
        if status == 0:
            return json.loads(out)
        lines = [line for line in err.splitlines() if line.strip() and not line.startswith("{")]
        message = next((li for li in lines if li.startswith("error: ")), lines[-1] if lines else f"status {status}")
        raise GratingError(message.removeprefix("error: "))

    def cancel(self) -> None:
        """Stop the process and remove what it has written so far."""
        self._process.terminate()
        self._process.wait()
        for partial in self._folder.glob(f".*.{self._process.pid}.partial*"):
            shutil.rmtree(partial) if partial.is_dir() else partial.unlink()
        self._private.cleanup()


def child_environment() -> dict[str, str]:
    """The process's environment: it finds precompute in this extension, the packages where this Blender has them, and
    the extension's cache.

    Raises GratingError if a package is missing."""
    packages = ("numpy", "OpenEXR", "PIL", "gwyfile")
    folders = [str(ROOT)]
    for package in packages:
        spec = importlib.util.find_spec(package)
        if spec is None:
            raise GratingError(f"{package}: missing from this Blender; reinstall the extension for this platform")
        origin = Path(spec.origin)
        folders.append(str(origin.parents[1] if origin.name == "__init__.py" else origin.parent))
    path = os.pathsep.join(dict.fromkeys(folders))
    ours = {"PYTHONPATH": path, "PYTHONIOENCODING": "utf-8", FOLDER_VARIABLE: str(cache_folder())}
    return {**os.environ, **ours}
