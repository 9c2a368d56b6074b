# SPDX-License-Identifier: GPL-3.0-or-later
"""The packages built by `./dev build`, and every available Blender with its own user folder."""

import os
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from devtools import ROOT, environments, packages
from devtools.blender import SHIM, find_binary
from devtools.steps import clean_environment


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The zip of each platform, by the platform's name in the file name: linux_x64, ..."""
    folder = tmp_path_factory.mktemp("packages")
    paths = packages.build(environments.require(environments.BPY45), folder)
    return {path.stem.rpartition("-")[2]: path for path in paths}


def copy_checkout(folder: Path) -> Path:
    """Copy the files that git does not ignore into a folder, with the wheels and the drafts of the fixture `built`."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    for name in ("wheels", "drafts"):
        shutil.copytree(ROOT / name, folder / name)
    return folder


@dataclass(frozen=True)
class Blender:
    """A Blender with its own user folder, started in the folder `started_in`, or in the tests' working folder."""

    command: tuple[str, ...]
    user_folder: Path
    started_in: Path | None = None

    def start(self, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
        line = [*self.command, *map(str, arguments)]
        variables = clean_environment(BLENDER_USER_RESOURCES=str(self.user_folder))
        variables["NATURAL_GRATINGS_CACHE"] = str(self.user_folder / "cache")
        return subprocess.run(line, capture_output=True, text=True, env=variables, timeout=600, cwd=self.started_in)

    def run(self, *arguments: str | Path) -> str:
        """The output; the test fails with it if the exit status is not 0."""
        answer = self.start(*arguments)
        assert answer.returncode == 0, f"{answer.args}\n{answer.stdout}\n{answer.stderr}"
        return answer.stdout

    def run_script(self, script: Path, *arguments: str | Path) -> str:
        return self.run("--background", "--python-exit-code", "1", "--python", script, "--", *arguments)

    def run_grating(self, *arguments: str | Path, scene: Path | None = None) -> str:
        return self.run("--background", *([scene] if scene else []), "--command", "grating", *arguments)


def bpy_command(environment: environments.Environment) -> tuple[str, ...]:
    if not environments.is_ready(environment):
        pytest.skip(f"{environment.name} is not made: Python {environment.python_version} is missing")
    return str(environment.python), "-P", str(SHIM)


def chosen_binary() -> str | Path | None:
    """The real Blender to test, if there is one."""
    return os.environ.get("NATURAL_GRATINGS_BLENDER") or find_binary()


def binary_command() -> tuple[str, ...]:
    binary = chosen_binary()
    if not binary:
        pytest.skip("no Blender binary: on Debian ./dev blender-setup brings one")
    return (str(binary),)


COMMANDS = {
    "bpy-4.5": lambda: bpy_command(environments.BPY45),
    "bpy-5.3": lambda: bpy_command(environments.BPY53),
    "binary": binary_command,
}


@pytest.fixture(scope="module", params=COMMANDS)
def empty_blender(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Blender:
    """Each available Blender, with an empty user folder."""
    return Blender(COMMANDS[request.param](), tmp_path_factory.mktemp("user"))


@pytest.fixture(scope="session")
def install(built: dict[str, Path], tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Blender]:
    """A function: the Blender of this name, with a copy of the user folder in which the zip was installed once."""
    folders: dict[str, Path] = {}

    def install(name: str) -> Blender:
        command = COMMANDS[name]()
        if name not in folders:
            folders[name] = tmp_path_factory.mktemp("installed")
            Blender(command, folders[name]).run_script(Path(__file__).with_name("install.py"), built["linux_x64"])
        folder = tmp_path_factory.mktemp("user")
        shutil.copytree(folders[name], folder, symlinks=True, dirs_exist_ok=True)
        return Blender(command, folder)

    return install


@pytest.fixture(scope="module", params=COMMANDS)
def blender(request: pytest.FixtureRequest, install: Callable[[str], Blender]) -> Blender:
    """Each available Blender, with the extension installed from its zip."""
    return install(request.param)


@pytest.fixture
def without_packages(tmp_path: Path) -> Callable[..., Blender]:
    """A function: a Blender whose Python has none of the packages with these import names. Of a bpy wheel it hides
    those of its environment; a binary ignores PYTHONPATH, and has only what the extension brings."""

    def hide(blender: Blender, *packages: str) -> Blender:
        (tmp_path / "hidden").mkdir()
        hidden = f"import sys\nsys.modules.update(dict.fromkeys({packages!r}))\n"
        (tmp_path / "hidden" / "sitecustomize.py").write_text(hidden)
        return replace(blender, command=("env", f"PYTHONPATH={tmp_path / 'hidden'}", *blender.command))

    return hide
