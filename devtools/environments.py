# SPDX-License-Identifier: GPL-3.0-or-later
"""The environments under .env, made from pyproject.toml: one for each version of Blender, one for ./dev lint,
and one for ./dev docs."""

import contextlib
import fcntl
import json
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from . import ENVIRONMENTS, ROOT, DevError
from .machine import find_python
from .steps import run_step, run_together, say


@dataclass(frozen=True)
class Environment:
    """A virtual environment. Its folder and its dependency group have its name."""

    name: str
    python_version: str
    blender_version: str = ""  # "" for an environment without Blender

    @property
    def folder(self) -> Path:
        return ENVIRONMENTS / self.name

    @property
    def python(self) -> Path:
        return self.folder / "bin" / "python"

    @property
    def stamp(self) -> Path:
        """The list of installed requirements. It is written last, so it is missing after an interruption."""
        return self.folder / "stamp.json"

    @property
    def bpy_folder(self) -> Path:
        """The folder of Blender's own files (scripts, hidden packages) in the bpy wheel."""
        packages = self.folder / "lib" / f"python{self.python_version}" / "site-packages"
        return packages / "bpy" / self.blender_version


BPY45 = Environment("py311-bpy45", "3.11", "4.5")
BPY52 = Environment("py313-bpy52", "3.13", "5.2")
BPY53 = Environment("py313-bpy53", "3.13", "5.3")
ALL = (BPY45, BPY52, BPY53)
LINT = Environment("lint", "3.11")
DOCS = Environment("docs", "3.11")


def dependency_group(name: str) -> list[str]:
    """The pinned requirements of a group in pyproject.toml, including those of the groups that it includes."""
    groups = tomllib.loads((ROOT / "pyproject.toml").read_text())["dependency-groups"]
    requirements: list[str] = []
    for entry in groups[name]:
        requirements += [entry] if isinstance(entry, str) else dependency_group(entry["include-group"])
    return requirements


def is_ready(environment: Environment) -> bool:
    """Whether the environment is complete and matches the present pins."""
    try:
        stamped = json.loads(environment.stamp.read_text())
    except (OSError, ValueError):
        return False
    return sorted(stamped) == sorted(dependency_group(environment.name)) and environment.python.exists()


@contextlib.contextmanager
def one_at_a_time() -> Iterator[None]:
    """Lock the set-up: two ./dev processes at the same time would corrupt each other's environment."""
    ENVIRONMENTS.mkdir(exist_ok=True)
    with (ENVIRONMENTS / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def make(environment: Environment, base_python: Path) -> None:
    """Make the environment, or update a complete one to the present pins."""
    logs = ENVIRONMENTS / "logs"
    if not environment.stamp.exists() or not environment.python.exists():
        command = [base_python, "-m", "venv", "--clear", environment.folder]
        run_step(f"{environment.name}: new environment", command, logs / f"{environment.name}-venv.log")
    environment.stamp.unlink(missing_ok=True)
    requirements = dependency_group(environment.name)
    pip = [environment.python, "-m", "pip", "install", "--no-input", "--progress-bar=off"]
    pip += ["--disable-pip-version-check"]
    log = logs / f"{environment.name}-pip.log"
    run_step(f"{environment.name}: {len(requirements)} packages", [*pip, *requirements], log)
    environment.stamp.write_text(json.dumps(requirements, indent=1))


def ensure(*wanted: Environment) -> list[Environment]:
    """Make the wanted environments that are not ready. Returns the wanted environments that are ready afterwards.

    Without Python 3.13 on the machine, its environment is left out. Raises DevError if there is no Python 3.11."""
    if all(map(is_ready, wanted)):
        return list(wanted)
    with one_at_a_time():
        missing = [environment for environment in wanted if not is_ready(environment)]
        bases = {environment: find_python(environment.python_version) for environment in missing}
        if any(one.python_version == BPY45.python_version and bases[one] is None for one in missing):
            remedy = "apt-get install python3.11 python3.11-venv (Debian 12), or pyenv install 3.11"
            raise DevError(f"Python 3.11 not found; remedy: {remedy}")
        absent = [environment for environment in missing if bases[environment] is None]
        for environment in absent:
            say(f"no Python {environment.python_version} here: without Blender {environment.blender_version}")
        run_together([partial(make, environment, base) for environment, base in bases.items() if base])
    return [environment for environment in wanted if environment not in absent]


def require(environment: Environment) -> Environment:
    """The environment, made if necessary. Raises DevError if its Python is not on this machine."""
    if not ensure(environment):
        raise DevError(
            f"no Python {environment.python_version} for Blender {environment.blender_version}; "
            f"remedy: pyenv install {environment.python_version}"
        )
    return environment
