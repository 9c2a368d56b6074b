# SPDX-License-Identifier: GPL-3.0-or-later
"""Disks that are full, read-only or vanish, and what a fault leaves in a folder."""

import contextlib
import os
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest


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
    """Mount an own disk of a size at a folder. Skips the test if this user may not."""
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
        pytest.skip("only root may mount a disk")
    done = subprocess.run(["mount", *words], capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(done.stderr.strip())
