# SPDX-License-Identifier: GPL-3.0-or-later
"""Precompute's work in a process of its own, so that Blender's interface stays alive and cancelling is a terminate."""

import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from ...precompute.bake.cache import FOLDER_VARIABLE
from ...precompute.base.failure import GratingError
from ..scene.gratings import cache_folder

ROOT = Path(__file__).resolve().parents[2]


class Job:
    """`python -m precompute bake ...` (or another verb that writes a folder) with JSON progress. The pipes are files:
    they never fill, never block."""

    def __init__(self, arguments: list[str], folder: Path, verb: str = "bake"):
        self._folder = folder
        self._logs = tempfile.TemporaryDirectory(prefix="natural-gratings-")
        logs = Path(self._logs.name)
        self._out_path, self._err_path = logs / "result.json", logs / "progress.jsonl"
        command = [sys.executable, "-B", "-m", "precompute", verb, *arguments]
        command += ["-o", str(folder), "--json", "-", "--progress", "json"]
        with self._out_path.open("wb") as out, self._err_path.open("wb") as err:
            self._process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=out, stderr=err, env=child_environment()
            )

    @property
    def running(self) -> bool:
        return self._process.poll() is None

    def wait(self) -> None:
        self._process.wait()

    def progress(self) -> tuple[str, float]:
        """Stage and its fraction done, as last reported."""
        for line in reversed(self._err_path.read_text(errors="replace").splitlines()):
            if line.startswith("{") and line.endswith("}"):
                report = json.loads(line)
                return report["stage"], report["fraction"]
        return "starting", 0.0

    def result(self) -> dict:
        """The run's facts once it has ended. Raises GratingError with the process's own line if it failed."""
        out, err = self._out_path.read_text(errors="replace"), self._err_path.read_text(errors="replace")
        status = self._process.returncode
        self._logs.cleanup()
        if status == 0:
            return json.loads(out)
        lines = [line for line in err.splitlines() if line.strip() and not line.startswith("{")]
        message = next((li for li in lines if li.startswith("error: ")), lines[-1] if lines else f"status {status}")
        raise GratingError(message.removeprefix("error: "))

    def cancel(self) -> None:
        """Stop the process and leave nothing behind."""
        self._process.terminate()
        self._process.wait()
        for partial in self._folder.glob(f".*.{self._process.pid}.partial*"):
            shutil.rmtree(partial) if partial.is_dir() else partial.unlink()
        self._logs.cleanup()


def child_environment() -> dict[str, str]:
    """The child finds precompute in the extension, its packages where this Blender found them, and our cache."""
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
