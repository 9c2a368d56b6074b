# SPDX-License-Identifier: GPL-3.0-or-later
"""Guards for functions that Blender calls: handlers, timers, and the drawing of panels, lists and menus.

An exception in such a function would print a traceback at each redraw or scene change. A guard catches it and prints
one line on standard error, once. A panel also shows the line where its drawing stopped."""

import contextlib
import sys
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from traceback import extract_tb
from typing import Any

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
