# SPDX-License-Identifier: GPL-3.0-or-later
"""One fault of `./dev bench faults`: how it is run and judged. And disks that are full, read-only or vanish."""

import contextlib
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path


class SkipFault(Exception):
    """This machine cannot inject the fault; the text says why."""


@dataclass(frozen=True)
class Case:
    """A fault: its name, and a function that injects it in an empty folder and returns what the user sees. The function
    raises AssertionError, with what is lost, if the fault does harm."""

    name: str
    inject: Callable[[Path], str]


@dataclass(frozen=True)
class Row:
    """A fault's row of the table: its name, what the user sees, the reason for skipping it, and what failed."""

    fault: str
    sees: str
    skipped: str
    failed: tuple[str, ...]


def run(case: Case, folder: Path) -> Row:
    """Inject a fault."""
    try:
        # The folder's name differs from run to run.
        return Row(case.name, case.inject(folder).replace(f"{folder}/", ""), "", ())
    except SkipFault as reason:
        return Row(case.name, "", str(reason), ())
    except AssertionError as harm:
        return Row(case.name, "", "", (str(harm) or "an assertion",))


def contents(folder: Path) -> dict[str, bytes]:
    """The files of a folder by their paths in it."""
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def assert_no_leftovers(*folders: Path) -> None:
    """No unfinished file or folder is left."""
    left = [path for folder in folders for path in folder.rglob("*") if path.name.endswith(".partial")]
    left += [path for folder in folders for path in (folder / "partial").glob("*")]
    assert not left, f"left unfinished: {left[0].name}"


@contextlib.contextmanager
def small_disk(folder: Path, kib: int) -> Iterator[None]:
    """Mount an own disk of a size at a folder. Raises SkipFault if this user may not."""
    _mount("-t", "tmpfs", "-o", f"size={kib}k", "tmpfs", str(folder))
    try:
        yield
    finally:
        take_away(folder)


@contextlib.contextmanager
def read_only(folder: Path) -> Iterator[None]:
    """Make a folder read-only. Root ignores permissions, so the folder is mounted over itself."""
    if hasattr(os, "geteuid") and os.geteuid() != 0:
        mode = folder.stat().st_mode
        folder.chmod(0o555)
        try:
            yield
        finally:
            folder.chmod(mode)
        return
    _mount("--bind", str(folder), str(folder))
    try:
        _mount("-o", "remount,ro,bind", str(folder))
        yield
    finally:
        take_away(folder)


def take_away(folder: Path) -> None:
    """Unmount a disk, also one in use, as if it was pulled out."""
    subprocess.run(["umount", "-l", str(folder)], capture_output=True, check=False)


def _mount(*words: str) -> None:
    if shutil.which("mount") is None or not hasattr(os, "geteuid") or os.geteuid() != 0:
        raise SkipFault("only root may mount a disk")
    done = subprocess.run(["mount", *words], capture_output=True, text=True, check=False)
    if done.returncode:
        raise SkipFault(done.stderr.strip())
