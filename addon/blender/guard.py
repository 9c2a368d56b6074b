# SPDX-License-Identifier: GPL-3.0-or-later
"""Guards of the functions that Blender calls: handlers, timers, and what draws panels, lists and menus.

An exception that leaves such a function is a traceback, at each redraw or at each change of the scene. So no exception
leaves it. One line on the standard error says what failed, once; a panel also shows the line where it stopped."""

import contextlib
import sys
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from traceback import extract_tb
from typing import Any

from ...precompute.base.failure import GratingError, printable

# What was printed already: the function, the kind of the error, and where it was raised.
_printed: set[tuple[str, str, str]] = set()


def guarded(function: Callable[..., Any]) -> Callable[..., Any]:
    """A handler, a timer or a menu entry that never raises. It returns None where it fails, which ends a timer."""

    @wraps(function)
    def call(*given: Any) -> Any:
        try:
            return function(*given)
        except Exception as error:
            _report(function, error)
            return None

    return call


# Blender counts the arguments of the methods of registered classes, so each of these has the arguments of its kind.


def guarded_draw(draw: Callable[[Any, Any], None]) -> Callable[[Any, Any], None]:
    """The draw() of a panel, a menu or an operator that never raises."""

    @wraps(draw)
    def call(self: Any, context: Any) -> None:
        try:
            draw(self, context)
        except Exception as error:
            self.layout.label(text=_report(draw, error), icon="ERROR")

    return call


def guarded_item(function: Callable[..., None]) -> Callable[..., None]:
    """The draw_item() of a list that never raises."""

    @wraps(function)
    def draw_item(self, context, layout, data, item, icon, active_data, active_property) -> None:
        try:
            function(self, context, layout, data, item, icon, active_data, active_property)
        except Exception as error:
            layout.label(text=_report(function, error), icon="ERROR")

    return draw_item


def guarded_modal(modal: Callable[..., Any]) -> Callable[..., Any]:
    """The modal() of an operator that never raises. Where it fails, the operator is cancelled and reports the line."""

    @wraps(modal)
    def call(self: Any, context: Any, event: Any) -> Any:
        try:
            return modal(self, context, event)
        except Exception as error:
            line = _report(modal, error)
            with contextlib.suppress(Exception):  # it may have ended already
                self.cancel(context)
            self.report({"ERROR"}, line)
            return {"CANCELLED"}

    return call


def _report(function: Callable[..., Any], error: Exception) -> str:
    """Print the line about a failure, unless it was printed before; the line."""
    place = extract_tb(error.__traceback__)[-1]
    kind, where = type(error).__name__, f"{Path(place.filename).name}:{place.lineno}"
    name = f"{function.__module__.rpartition('.')[2]}.{function.__qualname__}"
    line = str(error)
    if not isinstance(error, GratingError):  # whose text tells what to do
        line = printable(f"{name} failed at {where} ({kind}: {error}); report this line")
    if (name, kind, where) not in _printed:
        _printed.add((name, kind, where))
        print(f"Natural Gratings: {line}", file=sys.stderr)
    return line
