# SPDX-License-Identifier: GPL-3.0-or-later
"""What the machine must provide: Python interpreters, and the system libraries that Blender loads."""

import ctypes
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from . import ENVIRONMENTS, DevError
from .steps import clean_environment, run_step

# Debian packages, and for each the library to look for on other systems. The DRI drivers have no library.
BLENDER_LIBRARIES = {
    "libegl1": "libEGL.so.1",
    "libegl-mesa0": "libEGL_mesa.so.0",
    "libgl1": "libGL.so.1",
    "libgl1-mesa-dri": None,
    "libopengl0": "libOpenGL.so.0",
    "libx11-6": "libX11.so.6",
    "libxi6": "libXi.so.6",
    "libxrender1": "libXrender.so.1",
    "libxxf86vm1": "libXxf86vm.so.1",
    "libxfixes3": "libXfixes.so.3",
    "libxkbcommon0": "libxkbcommon.so.0",
    "libsm6": "libSM.so.6",
}


def is_debian() -> bool:
    return shutil.which("dpkg-query") is not None and shutil.which("apt-get") is not None


def install_debian_packages(packages: Sequence[str], reason: str) -> None:
    """Install packages as root. Raises DevError with the command to run if the user is not root."""
    install = ["apt-get", "install", "-y", "--no-install-recommends", *packages]
    if os.geteuid() != 0:
        raise DevError(f"{reason}; remedy: sudo apt-get update && sudo {' '.join(install)}")
    logs = ENVIRONMENTS / "logs"
    quiet = {"DEBIAN_FRONTEND": "noninteractive"}
    run_step("package lists", ["apt-get", "update"], logs / "apt-update.log", **quiet)
    run_step(f"install {' '.join(packages)}", install, logs / "apt-install.log", **quiet)


def installed_debian_packages(packages: Sequence[str]) -> set[str]:
    """The packages of the list that are installed."""
    query = ["dpkg-query", "--show", "--showformat=${db:Status-Abbrev} ${Package}\n", *packages]
    answer = subprocess.run(query, capture_output=True, text=True).stdout
    return {line.split()[-1] for line in answer.splitlines() if line.startswith("ii")}


def loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def missing_blender_libraries() -> list[str]:
    """The missing packages (on Debian) or libraries (elsewhere) that `import bpy` and EEVEE need."""
    if sys.platform != "linux":
        return []
    if is_debian():
        installed = installed_debian_packages(list(BLENDER_LIBRARIES))
        return [package for package in BLENDER_LIBRARIES if package not in installed]
    return [soname for soname in BLENDER_LIBRARIES.values() if soname and not loads(soname)]


def ensure_blender_libraries() -> None:
    """Install missing libraries as root on Debian. Raises DevError with the remedy if that is impossible."""
    missing = missing_blender_libraries()
    if not missing:
        return
    reason = f"Blender needs system libraries: {', '.join(missing)} missing"
    if not is_debian():
        raise DevError(f"{reason}; remedy: install the packages of your distribution that hold them")
    install_debian_packages(missing, reason)


def python_candidates(version: str) -> Iterator[Path]:
    """Paths where a Python of a version such as "3.13" may be: on PATH, and in the folders of pyenv and uv."""
    name = f"python{version}"
    if sys.version_info[:2] == tuple(map(int, version.split("."))):
        yield Path(sys.executable)
    for folder in os.get_exec_path():
        yield Path(folder) / name
    pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv")
    yield from sorted(pyenv.glob(f"versions/{version}.*/bin/{name}"))
    yield from sorted(Path.home().glob(f".local/share/uv/python/cpython-{version}.*/bin/{name}"))


def answers(python: Path, code: str) -> bool:
    try:
        answer = subprocess.run([python, "-c", code], capture_output=True, env=clean_environment(), timeout=30)
        return answer.returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


def runnable_pythons(version: str) -> Iterator[Path]:
    """The interpreters of a version that run."""
    major, minor = version.split(".")
    is_version = f"import sys; assert sys.version_info[:2] == ({major}, {minor})"
    return (path for path in python_candidates(version) if path.is_file() and answers(path, is_version))


def makes_environments(python: Path) -> bool:
    return answers(python, "import ensurepip, venv")


def find_python(version: str) -> Path | None:
    """The first interpreter of a version that runs and can make environments, or None.

    On Debian this needs the package python3.11-venv, which is installed if the user is root. Raises DevError if an
    interpreter runs but cannot make environments."""
    running = list(runnable_pythons(version))
    able = next(filter(makes_environments, running), None)
    if able or not running:
        return able
    reason = f"{running[0]} cannot make environments"
    if not is_debian():
        raise DevError(f"{reason}; remedy: install its venv and ensurepip modules")
    install_debian_packages([f"python{version}-venv"], reason)
    return next(filter(makes_environments, running), None)
