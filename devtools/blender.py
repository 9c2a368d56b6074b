# SPDX-License-Identifier: GPL-3.0-or-later
"""Finding a Blender and starting it with this working tree as its extension. The Blender is a real binary, or the bpy
wheel behind the shim (blender_shim.py)."""

import os
import re
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

from . import ENVIRONMENTS, EXTENSION, ROOT, DevError, environments
from .environments import Environment
from .extension import link_extension
from .machine import ensure_blender_libraries
from .packages import fetch_wheels
from .steps import become, clean_environment, say

OLDEST = (4, 5)
CHROOT_BLENDER = ENVIRONMENTS / "sid-blender"
SHIM = ROOT / "devtools" / "blender_shim.py"
# If one of these is set, the developer's own Blender set-up is used.
USER_FOLDERS = ("BLENDER_USER_RESOURCES", "BLENDER_USER_EXTENSIONS")


@dataclass(frozen=True)
class Launch:
    """A command line, and extra environment variables."""

    command: list[str]
    variables: dict[str, str] = field(default_factory=dict)

    def run(self) -> NoReturn:
        """Replace this process by the command."""
        become(self.command, clean_environment(**self.variables))


def binary_version(binary: str | Path) -> tuple[int, int]:
    """The version (major, minor) of a Blender binary. Raises DevError if it is no Blender or does not run."""
    try:
        answer = subprocess.run([binary, "--version"], capture_output=True, text=True, timeout=120)
    except (OSError, subprocess.TimeoutExpired) as fault:
        raise DevError(f"{binary}: does not run ({fault}); remedy: name a Blender binary") from fault
    found = re.search(r"^Blender (\d+)\.(\d+)", answer.stdout, re.MULTILINE)
    if not found:
        raise DevError(f"{binary}: is not a Blender binary; remedy: name one with --blender PATH")
    return int(found[1]), int(found[2])


def require_binary(path: str) -> Path:
    """The binary that --blender names. Raises DevError if it is missing, no Blender, or too old."""
    binary = shutil.which(path)
    if binary is None:
        raise DevError(f"{path}: no such program; remedy: give --blender the path of a Blender binary")
    if binary_version(binary) < OLDEST:
        raise DevError(f"{path}: is older than Blender 4.5; remedy: name a newer one")
    return Path(binary).absolute()


def find_binary() -> Path | None:
    """The Blender binary on PATH, else the one that `./dev blender-setup` made, else None."""
    for candidate in (shutil.which("blender"), CHROOT_BLENDER):
        if candidate is None or not Path(candidate).exists():
            continue
        try:
            return require_binary(str(candidate))
        except DevError as fault:
            say(f"passed over: {fault}")
    return None


def has_own_user_folder() -> bool:
    """Whether the environment sets a Blender user folder."""
    return any(os.environ.get(name) for name in USER_FOLDERS)


def launch_binary(binary: Path, arguments: Sequence[str]) -> Launch:
    """How to start a real Blender, with a user folder under .env that links the working tree as its extension."""
    if has_own_user_folder():
        return Launch([str(binary), *arguments])
    fetch_wheels(environments.require(environments.BPY45))
    user = ENVIRONMENTS / "blender-user"
    link_extension(user, wheels=True)
    addons = [] if "--factory-startup" in arguments else ["--addons", EXTENSION]
    return Launch([str(binary), *addons, *arguments], {"BLENDER_USER_RESOURCES": str(user)})


def launch_shim(environment: Environment, arguments: Sequence[str]) -> Launch:
    """How to start the bpy wheel behind the shim, with a user folder like launch_binary's."""
    ensure_blender_libraries()
    environments.require(environment)
    user = ENVIRONMENTS / "bpy-user"
    link_extension(user)
    variables = {"NATURAL_GRATINGS_LINKED_EXTENSIONS": str(user / "extensions")}
    if not has_own_user_folder():
        variables["BLENDER_USER_RESOURCES"] = str(user)
    return Launch([str(environment.python), "-P", str(SHIM), *arguments], variables)
