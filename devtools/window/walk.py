# SPDX-License-Identifier: GPL-3.0-or-later
"""An artist's walk through the extension in a real Blender with a window, with a picture of each station."""

import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from .. import EXTENSION, ROOT, DevError, environments
from ..extension import link_extension
from ..packages import build, fetch_wheels
from ..steps import clean_environment, say
from .display import display

HERE = Path(__file__).parent
SIZE, SMALL, TALL, WIDE = (1280, 1000), (1280, 720), (1400, 1700), (1200, 640)
# A walk takes two to four minutes. A Blender that hangs is ended.
_LIMIT_SECONDS = 1200


def walk(binary: Path, folder: Path) -> list[Path]:
    """Walk with a Blender binary and this working tree as its extension. Returns the pictures, which replace those of
    an earlier walk in `folder`. Raises DevError if a station does not show what it should."""
    fetch_wheels(environments.require(environments.BPY45))
    folder.mkdir(parents=True, exist_ok=True)
    for former in folder.glob("[0-9][0-9]_*.png"):
        former.unlink()
    with tempfile.TemporaryDirectory(prefix="natural-gratings-walk-") as private:
        user = Path(private)
        link_extension(user, wheels=True)
        variables = {"BLENDER_USER_RESOURCES": private, "NATURAL_GRATINGS_CACHE": str(user / "cache")}
        start = [binary, "--addons", EXTENSION]
        say("walk: the stage ...")
        run([*start, *stage_arguments(folder)], variables)
        say("walk: pictures of each station ...")
        with display(*SIZE, folder=user) as screen:
            run([*start, *walk_arguments(folder, user)], {**variables, "DISPLAY": screen})
    return sorted(folder.glob("[0-9][0-9]_*.png"))


def first_hour(binary: Path, folder: Path) -> list[Path]:
    """Walk through an artist's first hour: the built package, installed into an empty profile, on a small screen.
    Returns the pictures. Raises DevError as walk does."""
    environment = environments.require(environments.BPY45)
    folder.mkdir(parents=True, exist_ok=True)
    for former in folder.glob("[0-9][0-9]_*.png"):
        former.unlink()
    with tempfile.TemporaryDirectory(prefix="natural-gratings-walk-") as private:
        user = Path(private)
        packages = build(environment, user / "packages")
        package = next(path for path in packages if "linux" in path.name)
        variables = {"BLENDER_USER_RESOURCES": str(user / "profile"), "NATURAL_GRATINGS_CACHE": str(user / "cache")}
        say("walk: installing the package ...")
        install = ["--command", "extension", "install-file", "--repo", "user_default", "--enable", package]
        run([binary, *install], variables)
        run([binary, *stage_arguments(folder)], variables)  # for the scan
        say("walk: pictures of each station ...")
        with display(*SMALL, folder=user) as screen:
            arguments = window_arguments("first_hour_in_blender.py", SMALL, folder=folder, screen_folder=user)
            run([binary, *arguments], {**variables, "DISPLAY": screen})
    return sorted(folder.glob("[0-9][0-9]_*.png"))


def screens(binary: Path, folder: Path) -> list[Path]:
    """Take the pages' pictures of the panel, with this working tree as the extension. Returns the pictures. Raises
    DevError as walk does."""
    say("walk: pictures of the panel ...")
    play(binary, "screens_in_blender.py", TALL, folder)
    return sorted(folder.glob("*.png"))


def film(binary: Path, folder: Path) -> list[Path]:
    """Make the film of Show Me, show_me.webp, with this working tree as the extension. Returns its path. Raises
    DevError as walk does."""
    made = folder / "show_me.webp"
    environment = environments.require(environments.BPY53)  # for Pillow
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="natural-gratings-film-") as frames:
        say("walk: the film of Show Me ...")
        play(binary, "film_in_blender.py", WIDE, Path(frames))
        run([environment.python, HERE / "film.py", frames, made], {})
    return [made]


def play(binary: Path, script: str, size: tuple[int, int], folder: Path) -> None:
    """Let simulated hands do what a script of this room says, in Blender's start file on a screen of this size. The
    script's pictures go into `folder`. Raises DevError as walk does."""
    fetch_wheels(environments.require(environments.BPY45))
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="natural-gratings-walk-") as private:
        user = Path(private)
        link_extension(user, wheels=True)
        variables = {"BLENDER_USER_RESOURCES": private, "NATURAL_GRATINGS_CACHE": str(user / "cache")}
        with display(*size, folder=user) as screen:
            arguments = window_arguments(script, size, folder=folder, screen_folder=user)
            run([binary, "--addons", EXTENSION, *arguments], {**variables, "DISPLAY": screen})


def stage_arguments(folder: Path) -> list[str | Path]:
    """Arguments for the Blender that makes the stage in `folder`."""
    return ["--background", "--python-exit-code", "1", "--python", HERE / "walk_stage.py", "--", folder]


def walk_arguments(folder: Path, screen_folder: Path) -> list[str | Path]:
    """Arguments for the Blender that walks on the stage in `folder`. The screen's picture is in `screen_folder`."""
    opened = folder / "stage.blend"
    return window_arguments("walk_in_blender.py", SIZE, folder=folder, screen_folder=screen_folder, opened=[opened])


def window_arguments(
    script: str, size: tuple[int, int], *, folder: Path, screen_folder: Path, opened: Sequence[Path] = ()
) -> list[str | Path]:
    """Arguments for a Blender whose window fills a screen of this size, where simulated hands do what a script of this
    room says. `opened`: the file that it opens first."""
    options = ["--enable-event-simulate", "--window-geometry", "0", "0", *map(str, size)]
    return [*options, *opened, "--python", HERE / script, "--", folder, screen_folder / "Xvfb_screen0"]


def run(command: list[str | Path], variables: dict[str, str]) -> None:
    """Run Blender. Raises DevError with the last line of its errors if it fails."""
    done = subprocess.run(
        command, env=clean_environment(**variables), cwd=ROOT, capture_output=True, text=True, timeout=_LIMIT_SECONDS
    )
    print(done.stdout, end="")
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        print(done.stderr, end="")
        raise DevError(f"the walk stopped: {lines[-1] if lines else done.returncode}; see its pictures up to there")
