# SPDX-License-Identifier: GPL-3.0-or-later
"""Guards for functions that Blender calls (handlers, timers, drawing), and for paths in a .blend file.

An exception in such a function would print a traceback at each redraw or scene change. A guard catches it and prints
one line on standard error, once. A panel also shows the line where its drawing stopped. A path may come from another
computer."""

import contextlib
import os
import sys
from collections.abc import Callable
from functools import wraps
from pathlib import Path, PurePath, PureWindowsPath
from traceback import extract_tb
from typing import Any

import bpy

from ...precompute.base.failure import GratingError, printable

# Failures that were printed already: the function, the kind of the error, and where it was raised.
_printed: set[tuple[str, str, str]] = set()


def guarded(function: Callable[..., Any]) -> Callable[..., Any]:
    """Guard a handler, timer or menu entry. After an exception it returns None, which ends a timer."""

    @wraps(function)
    def call(*given: Any) -> Any:
        try:
            return function(*given)
        except Exception as error:
            _report(function, error)
            return None

    return call


# Blender checks the number of arguments of a registered class's methods, so each guard has its method's arguments.


def guarded_draw(draw: Callable[[Any, Any], None]) -> Callable[[Any, Any], None]:
    """Guard the draw() of a panel, menu or operator."""

    @wraps(draw)
    def call(self: Any, context: Any) -> None:
        try:
            draw(self, context)
        except Exception as error:
            self.layout.label(text=_report(draw, error), icon="ERROR")

    return call


def guarded_item(function: Callable[..., None]) -> Callable[..., None]:
    """Guard the draw_item() of a list."""

    @wraps(function)
    def draw_item(self, context, layout, data, item, icon, active_data, active_property) -> None:
        try:
            function(self, context, layout, data, item, icon, active_data, active_property)
        except Exception as error:
            layout.label(text=_report(function, error), icon="ERROR")

    return draw_item


def guarded_modal(modal: Callable[..., Any]) -> Callable[..., Any]:
    """Guard the modal() of an operator. After an exception the operator is cancelled and reports the line."""

    @wraps(modal)
    def call(self: Any, context: Any, event: Any) -> Any:
        try:
            return modal(self, context, event)
        except Exception as error:
            line = _report(modal, error)
            with contextlib.suppress(Exception):  # the operator may have ended already
                self.cancel(context)
            self.report({"ERROR"}, line)
            return {"CANCELLED"}

    return call


def _report(function: Callable[..., Any], error: Exception) -> str:
    """Print one line about a failure, unless it was printed before. Return the line."""
    place = extract_tb(error.__traceback__)[-1]
    kind, where = type(error).__name__, f"{Path(place.filename).name}:{place.lineno}"
    name = f"{function.__module__.rpartition('.')[2]}.{function.__qualname__}"
    line = str(error)
    if not isinstance(error, GratingError):  # a GratingError's text already gives the remedy
        line = printable(f"{name} failed at {where} ({kind}: {error}); report this line")
    if (name, kind, where) not in _printed:
        _printed.add((name, kind, where))
        print(f"Natural Gratings: {line}", file=sys.stderr)
    return line


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
