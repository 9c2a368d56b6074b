# SPDX-License-Identifier: GPL-3.0-or-later
"""Paths in a .blend file, which another computer may have saved."""

import os
from pathlib import Path, PurePath, PureWindowsPath

import bpy

from ...precompute.base.failure import GratingError


def absolute(text: str, library: bpy.types.Library | None = None) -> str:
    """The path that a text in the open file, or in a library, stands for, with `//` as the file's folder.

    Blender on Windows writes backslashes after `//`. Elsewhere they are separators too, unless a file has such a
    name."""
    path = bpy.path.abspath(text, library=library)
    if os.sep == "/" and text.startswith("//") and "\\" in text and not os.path.lexists(path):
        return bpy.path.abspath(text.replace("\\", "/"), library=library)
    return path


def pure(text: str) -> PurePath:
    """The path that a text stands for, also one from Windows such as C:\\bakes\\skin.exr, to look at its parts."""
    return PureWindowsPath(text) if is_foreign(text) else Path(absolute(text))


def is_foreign(text: str) -> bool:
    """Whether a text is an absolute path of Windows, which leads nowhere on this computer."""
    return os.sep == "/" and bool(PureWindowsPath(text).drive) and not text.startswith("/")


def own_path(text: str) -> Path:
    """The absolute path that a text stands for. Raises GratingError for a path of Windows on another system."""
    if is_foreign(text):
        raise GratingError(text, "a path of Windows, not of this computer", "choose it here again")
    return Path(absolute(text)).absolute()


def is_there(path: Path) -> bool:
    """Whether a path leads to a file; false for a path that is too long or invalid for the system."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def kept_path(path: str) -> str:
    """The path, if a .blend file can store it. Raises GratingError if it is not valid UTF-8."""
    try:
        path.encode()
    except UnicodeEncodeError as error:
        raise GratingError(path, "Blender cannot use its name, which is not UTF-8", "rename it") from error
    return path
