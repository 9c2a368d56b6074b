# SPDX-License-Identifier: GPL-3.0-or-later
"""Custom properties as they are read: a .blend is a file like any other, and may hold anything under our names.

Each function gives the value if it has the right type, length and range, else the default. Nothing raises. A reader
says what its property holds, and need not ask whether it is there."""

import math
from collections.abc import Collection, Mapping
from typing import Any

import bpy
from idprop.types import IDPropertyArray, IDPropertyGroup

# A property that holds others; and what has custom properties: a data-block, a view layer, or such a property.
Record = IDPropertyGroup | Mapping[str, Any]
Holder = bpy.types.bpy_struct | Record
# The type codes of arrays that Blender makes of a list of floats, and of a list of truth values.
_FLOATS, _FLAGS = "fd", "bi"


def number(holder: Holder, name: str, default: float = 0.0, *, low: float = -math.inf, high: float = math.inf) -> float:
    """A finite number from `low` to `high`."""
    value = holder.get(name)
    if isinstance(value, int | float) and math.isfinite(value) and low <= value <= high:
        return value
    return default


def count(holder: Holder, name: str, most: int) -> int:
    """A whole number from 0 to `most`, by default 0."""
    value = number(holder, name, low=0, high=most)
    return value if isinstance(value, int) else 0


def flag(holder: Holder, name: str, default: bool = False) -> bool:
    """Yes or no. Earlier versions of Blender hold it as 0 or 1."""
    value = holder.get(name)
    return bool(value) if isinstance(value, int) and value in (0, 1) else default


def flags(holder: Holder, name: str, most: int) -> list[bool]:
    """A list of yes or no, of at most so many; empty by default."""
    value: Any = holder.get(name)
    is_list = _is_array(value) and value.typecode in _FLAGS and len(value) <= most
    return [bool(each) for each in value] if is_list and all(each in (0, 1) for each in value) else []


def has_floats(holder: Holder, name: str, length: int) -> bool:
    """Whether a property is a list of so many floats, each of any value."""
    value: Any = holder.get(name)
    if isinstance(value, list | tuple):  # not yet in Blender
        return len(value) == length and all(isinstance(each, float) for each in value)
    is_array = _is_array(value) and len(value) == length
    return is_array and (length == 0 or value.typecode in _FLOATS)


def numbers(holder: Holder, name: str, length: int) -> tuple[float, ...] | None:
    """So many finite floats; None by default."""
    value: Any = holder.get(name)
    found = tuple(value) if has_floats(holder, name, length) else (math.nan,)
    return found if all(map(math.isfinite, found)) else None


def some_numbers(holder: Holder, name: str, most: int) -> tuple[float, ...]:
    """At most so many finite floats; none by default."""
    value: Any = holder.get(name)
    length = len(value) if _is_array(value) or isinstance(value, list | tuple) else 0
    return (numbers(holder, name, length) or ()) if length <= most else ()


def text(holder: Holder, name: str, default: str = "") -> str:
    """A text."""
    value = holder.get(name)
    return value if isinstance(value, str) else default


def choice(value: object, allowed: Collection[str], default: str) -> str:
    """A value if it is one of those that are allowed. Also for Blender's enumerations, which are numbers in the file,
    and empty texts where the number stands for nothing."""
    return value if isinstance(value, str) and value in allowed else default


def record(holder: Holder, name: str) -> Record | None:
    """A property that holds others; None by default."""
    value = holder.get(name)
    return value if isinstance(value, IDPropertyGroup | dict) else None


def block(holder: Holder, name: str, kind: type[bpy.types.ID]) -> Any:
    """A pointer to a data-block of a kind; None by default, and where the data-block was deleted."""
    value = holder.get(name)
    return value if isinstance(value, kind) else None


def _is_array(value: Any) -> bool:
    return isinstance(value, IDPropertyArray)
